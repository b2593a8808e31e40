#include "work/pair_list.h"

#include <set>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {

std::vector<ImagePair> ReadPairList(const std::filesystem::path& file,
                                    const std::filesystem::path& folder) {
  constexpr size_t kColumns = 2;
  const TextFile text(file);
  std::vector<ImagePair> pairs;
  std::set<std::filesystem::path> found;
  std::vector<std::string_view> fields;
  for (const TextLine& line : text.lines()) {
    SplitAtBlanks(line.text, &fields);
    if (fields.size() < kColumns) {
      throw Error("{}: has the one column {}: expected the paths of two images", text.Where(line),
                  Quoted(fields.front()));
    }
    const ImagePair pair{folder / fields[0], folder / fields[1], text.Where(line)};
    for (const std::filesystem::path& image : {pair.a, pair.b}) {
      if (found.contains(image)) continue;
      std::error_code unreachable;
      if (!std::filesystem::is_regular_file(image, unreachable))
        throw Error("{}: image {}: no such file", pair.where, image.string());
      found.insert(image);
    }
    pairs.push_back(pair);
  }
  if (pairs.empty()) throw Error("{}: holds no pair of images", file.string());
  return pairs;
}

}  // namespace deepuav
