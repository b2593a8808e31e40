#pragma once

#include <string_view>

namespace deepuav {

/// A file of src/deepuav/evaluation/page/, or a library that the build put beside them
/// ("three.min.js"). Throws Error for a name that is none.
std::string_view PageFile(std::string_view name);

}  // namespace deepuav
