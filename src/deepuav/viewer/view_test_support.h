#pragma once

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

#include "deepuav/viewer/view_model.h"

namespace deepuav {

/// Of a binary message.
inline nlohmann::json HeaderOf(const std::string& bytes) {
  uint32_t length = 0;
  std::memcpy(&length, bytes.data(), sizeof(length));
  return nlohmann::json::parse(bytes.substr(sizeof(length), length));
}

/// Of any message: its text or its header.
inline nlohmann::json JsonOf(const ViewMessage& message) {
  return message.is_text ? nlohmann::json::parse(*message.bytes) : HeaderOf(*message.bytes);
}

}  // namespace deepuav
