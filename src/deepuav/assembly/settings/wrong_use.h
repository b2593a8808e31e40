#pragma once

#include "deepuav/base/error.h"

namespace deepuav {

/// What was asked for cannot be: an option that is unknown or out of range, or two that exclude one
/// another. The command line ends with another status than for input that cannot be read.
class WrongUse : public Error {
 public:
  using Error::Error;
};

}  // namespace deepuav
