"""Holds the sources to the architecture: which module may include which, and what libraries may not do."""

import pathlib
import re
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent

ARCHITECTURE = ROOT / "docs/architecture.md"
ARROW_TABLE_HEAD = "| module | holds | may include |"
ROOM_TABLE_HEAD = "| module | room | holds |"


def table_rows(page, head):
    """The cells of a Markdown table's rows below its head, as lists of texts."""
    lines = page.splitlines()
    rows = []
    for line in lines[lines.index(head) + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def read_arrows(page):
    """{module: [modules that it may include]} of the architecture's page; it may also use whatever these use."""
    return {
        module.strip("`"): [] if arrows == "-" else [arrow.strip() for arrow in arrows.split(",")]
        for module, _, arrows in table_rows(page, ARROW_TABLE_HEAD)
    }


def read_rooms(page):
    """{module: {its rooms}} of the architecture's page, and of `apps`."""
    rooms, module = {}, None
    for named, room, _ in table_rows(page, ROOM_TABLE_HEAD):
        module = named.strip("`") or module
        rooms.setdefault(module, set()).add(room.strip("`"))
    return rooms


ARROWS = read_arrows(ARCHITECTURE.read_text())

# Three parts that talk by value alone, so that their result cannot depend on threads' timing.
SIBLINGS = ("tracking", "mapping", "looping")
TIMELESS = ("localisation", "survey", *SIBLINGS)
TIMELESS_FORBIDDEN = re.compile(
    r"<(?:thread|mutex|shared_mutex|chrono|condition_variable|future|atomic)>|\bdeepuav/base/queue\.h\b|\bStopwatch\b"
)
# What is compiled against the installed library.
OUTSIDE = ("python", "examples", "tests/consumer")
LIBRARY_FORBIDDEN = re.compile(
    r"\bstd::(?:cout|cerr|clog)\b|\b(?:v?f?printf|puts|putchar)\s*\(|\bfmt::print\b|\b(?:quick_)?exit\s*\("
    r"|\babort\s*\(|\bsleep_(?:for|until)\b|\bu?sleep\s*\("
)
OPENVINO_INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]openvino/', re.MULTILINE)
MODULE_INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]deepuav/(\w+)/', re.MULTILINE)
MODULE_CALL = re.compile(r"\bdeepuav_module\s*\(([^)]*)\)")
CMAKE_KEYWORD = re.compile(r"[A-Z][A-Z_]+")
COMMENT_OR_LITERAL = re.compile(
    r'(?P<comment>//[^\n]*|/\*.*?\*/)|R"(?P<tag>[^(\s]*)\(.*?\)(?P=tag)"|"(?:\\.|[^"\\\n])*"', re.DOTALL
)


def allowed_modules(module):
    """The modules that `module` may use: its arrows, and theirs."""
    allowed = set()
    for used in ARROWS[module]:
        allowed |= {used} | allowed_modules(used)
    return allowed


def without_comments(text, keep_literals):
    """C++ source with comments blanked, and string literals too unless they are kept. Lines stay."""

    def blank(match):
        if keep_literals and not match.group("comment"):
            return match.group()
        return " " + "\n" * match.group().count("\n")

    return COMMENT_OR_LITERAL.sub(blank, text)


def module_arguments(cmake_text):
    """The keyword arguments of the call to deepuav_module, as lists by keyword."""
    arguments = {"DEPENDS": [], "TEST_LINK": []}
    call = MODULE_CALL.search(re.sub(r"#[^\n]*", "", cmake_text))
    keyword = None
    for word in call.group(1).split()[1:] if call else []:
        if CMAKE_KEYWORD.fullmatch(word):
            keyword = word
            arguments.setdefault(word, [])
        elif keyword:
            arguments[keyword].append(word)
    return arguments


def sources(folder):
    return sorted(path for path in folder.rglob("*") if path.suffix in (".h", ".cc"))


def check_depends(module, depends):
    if module not in ARROWS:
        yield f"src/deepuav/{module}: is no module of the architecture"
        return
    for used in depends:
        if used not in allowed_modules(module):
            yield f"src/deepuav/{module}/CMakeLists.txt: DEPENDS {used}: no such arrow in the architecture"


def check_arrows_are_needed(root):
    """An arrow that no include needs, of the module itself or of what only that arrow leads to."""
    used = {module: set() for module in ARROWS}
    for module in ARROWS:
        for path in sources(root / "src/deepuav" / module):
            used[module] |= set(MODULE_INCLUDE.findall(without_comments(path.read_text(), keep_literals=True)))
    for module, arrows in ARROWS.items():
        for arrow in arrows:
            others = {other for one in arrows if one != arrow for other in {one} | allowed_modules(one)}
            if not used[module] & (({arrow} | allowed_modules(arrow)) - others):
                yield f"docs/architecture.md: {module} may include {arrow}, which no include of it needs"


def check_source(path, name, module, depends, test_links):
    text = path.read_text()
    is_test = path.name.endswith("_test.cc")
    usable = {module, *depends} | (test_links if is_test else set())
    code_and_literals = without_comments(text, keep_literals=True)
    for used in sorted(set(MODULE_INCLUDE.findall(code_and_literals))):
        if module in SIBLINGS and used in SIBLINGS and used != module:
            yield f"{name}: includes {used}: tracking, mapping and looping may not include one another"
        elif used not in usable:
            yield f"{name}: includes {used}, which is not in the DEPENDS of {module}"
    if is_test:
        return
    if module in TIMELESS:
        for found in TIMELESS_FORBIDDEN.findall(code_and_literals):
            yield f"{name}: mentions {found}: {module} may hold no thread, mutex or clock"
    for found in LIBRARY_FORBIDDEN.findall(without_comments(text, keep_literals=False)):
        yield f"{name}: mentions {found}: libraries may not print, exit or sleep"


def find_violations(root):
    """One line for each violation in the repository at `root`."""
    violations = []
    for listing in sorted((root / "src/deepuav").glob("*/CMakeLists.txt")):
        module = listing.parent.name
        arguments = module_arguments(listing.read_text())
        depends = arguments["DEPENDS"]
        test_links = {link.removeprefix("deepuav_") for link in arguments["TEST_LINK"]}
        violations += check_depends(module, depends)
        for path in sources(listing.parent):
            name = path.relative_to(root).as_posix()
            violations += check_source(path, name, module, depends, test_links)
    for folder in OUTSIDE:
        for path in sources(root / folder):
            text = without_comments(path.read_text(), keep_literals=True)
            for used in sorted(set(MODULE_INCLUDE.findall(text)) - {"api"}):
                violations.append(f"{path.relative_to(root).as_posix()}: includes {used}: other programs may include api alone")
    for folder in ("src", "apps", "bench", "tests"):
        for path in sources(root / folder):
            name = path.relative_to(root).as_posix()
            text = without_comments(path.read_text(), keep_literals=True)
            if OPENVINO_INCLUDE.search(text) and not name.startswith("src/deepuav/inference/"):
                violations.append(f"{name}: includes OpenVINO: only inference may")
    return violations


class RepositoryTest(unittest.TestCase):
    def test_every_module_is_found(self):
        self.assertGreater(len(sources(ROOT / "src/deepuav/base")), 0)
        self.assertIn("base", module_arguments((ROOT / "src/deepuav/geometry/CMakeLists.txt").read_text())["DEPENDS"])

    def test_keeps_the_architecture(self):
        violations = find_violations(ROOT)
        self.assertEqual(violations, [], "\n" + "\n".join(violations))


    def test_rooms_are_those_of_the_page(self):
        found = {}
        for listing in (ROOT / "src/deepuav").glob("*/CMakeLists.txt"):
            rooms = module_arguments(listing.read_text()).get("ROOMS")
            if rooms:
                found[listing.parent.name] = set(rooms)
        found["apps"] = {path.name for path in (ROOT / "apps").iterdir() if path.is_dir()}
        self.assertEqual(found, read_rooms(ARCHITECTURE.read_text()))

    def test_every_folder_is_a_module_of_the_page(self):
        folders = {listing.parent.name for listing in (ROOT / "src/deepuav").glob("*/CMakeLists.txt")}
        self.assertEqual(folders, set(ARROWS))

    def test_every_arrow_is_needed(self):
        self.assertEqual(list(check_arrows_are_needed(ROOT)), [])


class CheckTest(unittest.TestCase):
    """The check on small trees, good and bad."""

    GOOD = {
        "src/deepuav/base/CMakeLists.txt": "deepuav_module(base LINK fmt::fmt)",
        "src/deepuav/base/queue.h": "#include <mutex>\n",
        "src/deepuav/inference/CMakeLists.txt": "deepuav_module(inference DEPENDS base LINK openvino::runtime)",
        "src/deepuav/inference/network.cc": "#include <openvino/openvino.hpp>\n",
        "src/deepuav/geometry/CMakeLists.txt": "deepuav_module(geometry DEPENDS base)",
        "src/deepuav/geometry/se3.h": '#include "deepuav/base/error.h"\n',
        "src/deepuav/estimation/CMakeLists.txt": "deepuav_module(estimation DEPENDS geometry base)",
        "src/deepuav/tracking/CMakeLists.txt": "deepuav_module(tracking DEPENDS estimation geometry base\n"
        "  TEST_LINK deepuav_simulation)  # DEPENDS mapping",
        "src/deepuav/tracking/tracker.cc": '#include "deepuav/geometry/se3.h"\n// #include <thread>\n'
        '/* printf("x") */ auto text = "exit(1)"; void AtExit(int); OnExit(2); snprintf(b, 1, "");\n',
        "src/deepuav/tracking/tracker_test.cc": '#include "deepuav/simulation/world.h"\n#include <thread>\n',
        "apps/main.cc": '#include "deepuav/tracking/tracker.h"\nint main() { std::cout << 1; exit(0); }\n',
    }

    def violations_with(self, name, text):
        """The violations of the good tree once the file `name` holds `text`."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for path, content in {**self.GOOD, name: text}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(content)
            return find_violations(root)

    def assert_refused(self, name, text, reason):
        violations = self.violations_with(name, text)
        self.assertEqual(len(violations), 1, violations)
        self.assertTrue(violations[0].startswith(name.rsplit("/CMake", 1)[0]), violations)
        self.assertIn(reason, violations[0])

    def test_accepts_a_good_tree(self):
        self.assertEqual(self.violations_with("README.md", ""), [])

    def test_refuses_an_include_that_is_not_in_depends(self):
        for line in ('#include "deepuav/inference/network.h"', "  #  include <deepuav/inference/network.h>"):
            self.assert_refused("src/deepuav/geometry/camera.cc", line, "includes inference, which is not in")
        self.assert_refused("src/deepuav/geometry/a_test.cc", '#include "deepuav/map/map.h"', "includes map")
        self.assert_refused("src/deepuav/tracking/a.h", '#include "deepuav/simulation/world.h"', "includes simulation")

    def test_refuses_an_arrow_that_is_not_in_the_architecture(self):
        self.assert_refused("src/deepuav/base/CMakeLists.txt", "deepuav_module(base DEPENDS geometry)", "no such arrow")
        self.assert_refused(
            "src/deepuav/estimation/CMakeLists.txt",
            "deepuav_module(estimation LINK x\n  DEPENDS geometry\n  io)",
            "DEPENDS io: no such arrow",
        )
        self.assert_refused("src/deepuav/utils/CMakeLists.txt", "deepuav_module(utils)", "is no module")

    def test_refuses_parts_that_include_one_another(self):
        self.assert_refused("src/deepuav/tracking/a.cc", '#include "deepuav/mapping/mapper.h"', "one another")
        self.assert_refused("src/deepuav/tracking/a_test.cc", '#include "deepuav/looping/loop.h"', "one another")

    def test_refuses_threads_and_clocks_in_the_parts(self):
        for header in ("thread", "mutex", "chrono", "condition_variable"):
            self.assert_refused("src/deepuav/tracking/a.h", f"#include <{header}>", f"mentions <{header}>")
        self.assert_refused("src/deepuav/tracking/a.h", '#include "deepuav/base/queue.h"', "base/queue.h")
        self.assert_refused("src/deepuav/tracking/a.cc", "Stopwatch watch;", "Stopwatch")

    def test_refuses_the_inside_in_other_programs(self):
        for name in ("python/src/a.cc", "examples/cpp/a.cc", "tests/consumer/a.cc"):
            self.assert_refused(name, '#include "deepuav/system/slam.h"', "other programs may include api alone")
            self.assertEqual(self.violations_with(name, "#include <deepuav/api/slam.h>"), [])

    def test_refuses_openvino_outside_inference(self):
        for name in ("src/deepuav/geometry/a.h", "apps/run.cc", "tests/a_test.cc"):
            self.assert_refused(name, "#include <openvino/runtime/core.hpp>", "only inference may")

    def test_refuses_printing_exiting_and_sleeping_in_libraries(self):
        for line in (
            'std::cout << "x";',
            "std::cerr << 1;",
            'printf("x");',
            'std::fprintf(stderr, "x");',
            'fmt::print("x");',
            "exit(1);",
            "std::abort();",
            "std::this_thread::sleep_for(delay);",
            '/* fine */ auto path = "//"; exit(2);',
        ):
            self.assert_refused("src/deepuav/geometry/a.cc", line, "may not print, exit or sleep")


if __name__ == "__main__":
    unittest.main()
