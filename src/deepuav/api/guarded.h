#pragma once

#include <exception>

#include "deepuav/api/types.h"

namespace deepuav::api {

/// What `work` returns. No exception of another type than api's Error leaves it.
template <typename Work>
auto Guarded(const Work& work) -> decltype(work()) try {
  return work();
} catch (const Error&) {
  throw;
} catch (const std::exception& error) {
  throw Error(error.what());
}

}  // namespace deepuav::api
