#include "deepuav/io/files/options_file.h"

#include <fmt/format.h>

#include "deepuav/io/files/atomic_file.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

struct TrackingOptions {
  int keypoints = 800;
  double parallax_deg = 1.5;
  bool refine = true;
  std::string features = "superpoint";

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("keypoints", keypoints, "", "Key points kept in an image.", Between(1, 5000));
    visit("parallax_deg", parallax_deg, "deg", "Least parallax\nof a landmark.", Below(-90, 90));
    visit("refine", refine, "", "Whether patches are aligned.");
    visit("features", features, "", "Which network.");
  }
};

class OptionsFileTest : public ::testing::Test {
 protected:
  OptionsFileTest() {
    registry_.Add("tracking", &tracking_);
    registry_.Add("tracking.fine", &fine_);
  }
  void Load(const std::string& text) {
    LoadOptionsFile(folder_.Write("options.yaml", text), &registry_);
  }
  std::string Message(const std::string& text) {
    const std::string message = ErrorOf([&] { Load(text); });
    const std::string file = (folder_.path() / "options.yaml").string();
    EXPECT_TRUE(message.starts_with(file)) << message;
    return message.substr(std::min(file.size(), message.size()));
  }

  TemporaryFolder folder_;
  TrackingOptions tracking_, fine_;
  OptionRegistry registry_;
};

TEST_F(OptionsFileTest, SetsNestedAndDottedNames) {
  Load(
      "tracking:\n  keypoints: 1000\n  refine: false\n  fine:\n    parallax_deg: "
      "0.25\ntracking.features: \"a b\"\n");
  EXPECT_EQ(tracking_.keypoints, 1000);
  EXPECT_FALSE(tracking_.refine);
  EXPECT_EQ(fine_.parallax_deg, 0.25);
  EXPECT_EQ(tracking_.features, "a b");
  EXPECT_EQ(fine_.keypoints, 800);
}

TEST_F(OptionsFileTest, ASectionMayBeEmpty) {
  Load("tracking:\n");
  EXPECT_EQ(tracking_.keypoints, 800);
}

TEST_F(OptionsFileTest, NamesFileLineAndOptionOfAMistake) {
  EXPECT_EQ(
      Message("tracking:\n  keypoint: 1\n"),
      ":2: unknown option 'tracking.keypoint': the nearest known one is 'tracking.keypoints'");
  EXPECT_EQ(Message("tracking:\n  keypoints: many\n"),
            ":2: option tracking.keypoints is 'many': expected a whole number");
  EXPECT_EQ(Message("tracking:\n  keypoints: [1, 2]\n"),
            ":2: option 'tracking.keypoints' is a list: expected a value");
  EXPECT_EQ(Message("tracking:\n  keypoints:\n"),
            ":2: option 'tracking.keypoints' is empty: expected a value");
  EXPECT_EQ(Message("tracking:\n  keypoints: 1\ntracking.keypoints: 2\n"),
            ":3: option 'tracking.keypoints' is given twice");
  EXPECT_EQ(Message("tracking: 5\n").substr(0, 31), ":1: unknown option 'tracking': ");
  EXPECT_NE(Message("tracking: {\n").find("is no valid YAML"), std::string::npos);
  EXPECT_EQ(ErrorOf([&] { LoadOptionsFile("/nowhere/options.yaml", &registry_); }),
            "/nowhere/options.yaml: cannot be opened: No such file or directory");
}

TEST_F(OptionsFileTest, AnAliasOfItselfEnds) {
  EXPECT_NE(Message("tracking: &a\n  keypoints: 5\n  again: *a\n").find("options.yaml"), 0u);
}

TEST_F(OptionsFileTest, AliasesOfEmptySectionsEnd) {
  std::string text = "a0: &a0 {}\n";
  for (int level = 1; level <= 12; ++level) {
    text += fmt::format("a{0}: &a{0} {{", level);
    for (int key = 0; key < 10; ++key) text += fmt::format("k{}: *a{}, ", key, level - 1);
    text += "}\n";
  }
  EXPECT_EQ(Message(text), ":1: no options begin with 'a0': expected a section of options");
  EXPECT_EQ(Message("tracking:\n  fin: {}\n"),
            ":2: no options begin with 'tracking.fin': expected a section of options");
}

TEST_F(OptionsFileTest, SurvivesWritingAndLoading) {
  for (const char* text : {"", "null", "a: b # c", "\"quoted\" \\ back", "two\nlines\t", "-x", "3",
                           "-0.5", "ünï", "~", "true"}) {
    tracking_ = {.keypoints = 7, .parallax_deg = -1e-9, .refine = false, .features = text};
    const auto file = folder_.path() / "written.yaml";
    WriteFileAtomically(file, OptionsAsYaml(registry_));
    tracking_ = {};
    LoadOptionsFile(file, &registry_);
    EXPECT_EQ(tracking_.features, text) << ReadAll(file);
    EXPECT_EQ(tracking_.keypoints, 7);
    EXPECT_EQ(tracking_.parallax_deg, -1e-9);
    EXPECT_FALSE(tracking_.refine);
  }
}

TEST_F(OptionsFileTest, WritesUnitAndMeaning) {
  EXPECT_EQ(OptionsAsYaml(registry_),
            "tracking:\n"
            "  features: superpoint  # Which network.\n"
            "  fine:\n"
            "    features: superpoint  # Which network.\n"
            "    keypoints: 800  # Key points kept in an image. (1 to 5000)\n"
            "    parallax_deg: 1.5  # [deg] Least parallax?of a landmark. (-90 to below 90)\n"
            "    refine: true  # Whether patches are aligned.\n"
            "  keypoints: 800  # Key points kept in an image. (1 to 5000)\n"
            "  parallax_deg: 1.5  # [deg] Least parallax?of a landmark. (-90 to below 90)\n"
            "  refine: true  # Whether patches are aligned.\n");
}

}  // namespace
}  // namespace deepuav
