#pragma once

#include <common/mavlink.h>

#include <cstdint>
#include <string>
#include <vector>

namespace deepuav {

/// The messages that datagrams hold.
inline std::vector<mavlink_message_t> Decoded(const std::vector<std::string>& datagrams) {
  std::vector<mavlink_message_t> messages;
  for (const std::string& datagram : datagrams) {
    mavlink_message_t incoming = {}, message = {};
    mavlink_status_t status = {}, message_status = {};
    for (const char byte : datagram) {
      if (mavlink_frame_char_buffer(&incoming, &status, static_cast<uint8_t>(byte), &message,
                                    &message_status) == MAVLINK_FRAMING_OK)
        messages.push_back(message);
    }
  }
  return messages;
}

inline std::vector<mavlink_message_t> Of(const std::vector<mavlink_message_t>& all, uint32_t id) {
  std::vector<mavlink_message_t> some;
  for (const mavlink_message_t& message : all)
    if (message.msgid == id) some.push_back(message);
  return some;
}

inline std::string Bytes(const mavlink_message_t& message) {
  std::string bytes(MAVLINK_MAX_PACKET_LEN, '\0');
  bytes.resize(mavlink_msg_to_send_buffer(reinterpret_cast<uint8_t*>(bytes.data()), &message));
  return bytes;
}

inline std::string TimesyncFrom(uint8_t system, uint8_t component, int64_t clock_ns,
                                int64_t mark_ns) {
  mavlink_status_t status = {};
  mavlink_message_t message = {};
  const mavlink_timesync_t timesync = {clock_ns, mark_ns};
  mavlink_msg_timesync_encode_status(system, component, &status, &message, &timesync);
  return Bytes(message);
}

inline std::string HeartbeatFrom(uint8_t system, uint8_t component, uint8_t autopilot) {
  mavlink_status_t status = {};
  mavlink_message_t message = {};
  mavlink_heartbeat_t heartbeat = {};
  heartbeat.autopilot = autopilot;
  mavlink_msg_heartbeat_encode_status(system, component, &status, &message, &heartbeat);
  return Bytes(message);
}

/// As an autopilot tells its origin: degrees in parts of 1e-7, millimetres.
inline std::string OriginFrom(uint8_t system, int32_t latitude, int32_t longitude,
                              int32_t altitude_mm) {
  mavlink_status_t status = {};
  mavlink_message_t message = {};
  const mavlink_gps_global_origin_t origin = {latitude, longitude, altitude_mm, 0};
  mavlink_msg_gps_global_origin_encode_status(system, MAV_COMP_ID_AUTOPILOT1, &status, &message,
                                              &origin);
  return Bytes(message);
}

}  // namespace deepuav
