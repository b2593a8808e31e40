#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace deepuav {

/// The value of XMP's field `name`, with its name space, as an attribute (name="1"), as an element
/// (<name>1</name>) or as a list in one, with commas in between. Without blanks around it. Empty
/// where there is none.
std::string XmpText(std::string_view head, std::string_view name);

/// The number that the value begins with; nothing where it is none, or not finite.
std::optional<double> XmpNumber(std::string_view head, std::string_view name);

}  // namespace deepuav
