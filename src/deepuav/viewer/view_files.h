#pragma once

#include <string_view>

namespace deepuav {

/// A file of src/deepuav/viewer/page/. Throws Error for a name that is none.
std::string_view ViewFile(std::string_view name);

}  // namespace deepuav
