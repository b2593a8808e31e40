#include "deepuav/io/geodata/column_unit.h"

#include <algorithm>
#include <cctype>

namespace deepuav {
namespace {

constexpr std::string_view kReferences[] = {
    "84",      "above",       "absolute", "abs",       "agl",         "amsl",  "asl",  "atl",
    "baro",    "east",        "e",        "ellipsoid", "ellipsoidal", "geoid", "gnss", "gps",
    "ground",  "hae",         "home",     "level",     "mean",        "msl",   "n",    "north",
    "of",      "orthometric", "relative", "rel",       "rtk",         "sea",   "take", "off",
    "takeoff", "the",         "to",       "wgs"};

constexpr std::string_view kOtherUnits[] = {"mi",      "mile", "miles",  "dm",  "nm",
                                            "nmi",     "inch", "inches", "rad", "radian",
                                            "radians", "gon",  "grad",   "dms", "arcsec"};

template <size_t kCount>
bool IsAmong(std::string_view word, const std::string_view (&words)[kCount]) {
  return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

void AddWords(std::string_view text, std::vector<UnitWord>* words) {
  constexpr std::string_view kBetween = " ,:";
  for (size_t start = text.find_first_not_of(kBetween); start != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kBetween, start), text.size());
    words->push_back({std::string(text.substr(start, end - start)), true});
    start = text.find_first_not_of(kBetween, end);
  }
}

}  // namespace

std::vector<UnitWord> UnitWordsOf(std::string_view name) {
  constexpr std::string_view kOpening = "[({", kClosing = "])}";
  std::vector<UnitWord> words;
  size_t open = name.find_first_of(kOpening);
  std::string_view before = name.substr(0, open);
  while (open != std::string_view::npos) {
    const size_t close = std::min(name.find_first_of(kClosing, open), name.size());
    AddWords(name.substr(open + 1, close - open - 1), &words);
    open = name.find_first_of(kOpening, close);
  }
  before = before.substr(0, before.find_last_not_of(" _") + 1);
  if (const size_t gap = before.find_last_of(" _"); gap != std::string_view::npos)
    words.push_back({std::string(before.substr(gap + 1)), false});
  return words;
}

bool TellsReference(std::string_view word) {
  if (IsAmong(word, kReferences)) return true;
  // "wgs84", "egm2008", "navd88": no unit begins with a letter and has a digit.
  return std::isalpha(static_cast<unsigned char>(word.front())) != 0 &&
         std::ranges::any_of(word, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool IsOtherUnit(std::string_view word) { return IsAmong(word, kOtherUnits); }

}  // namespace deepuav
