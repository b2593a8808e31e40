#pragma once

#include <string>
#include <string_view>

#include "deepuav/base/time.h"

namespace deepuav {

/// Whether `text` begins like an ISO 8601 date and time: "2024-05-01T...".
bool LooksLikeIsoTime(std::string_view text);

/// An instant as of ISO 8601 and XML Schema: "2024-05-01T10:00:00.250Z", with a blank for the T,
/// "+02:00" for the Z, or neither (then UTC), as time since 1970 without leap seconds. Fractions
/// are read exactly. Throws Error naming `where` and what is expected.
Timestamp ParseIsoTime(std::string_view text, const std::string& where);

}  // namespace deepuav
