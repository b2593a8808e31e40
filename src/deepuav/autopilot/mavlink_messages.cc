#include "deepuav/autopilot/mavlink_messages.h"

#include <common/mavlink.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/sensors/standard_gravity.h"

namespace deepuav {
namespace {

constexpr uint8_t kComponent = MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY;
constexpr int kMostMessages = 64;  // In one datagram.
constexpr double kDegreeParts = 1e7, kMillimetres = 1e3;

/// The upper right triangle by rows.
void PackCovariance(const Matrix6d& covariance, float* packed) {
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      *packed++ = static_cast<float>(covariance(row, column));
  }
}

}  // namespace

template <typename Encode>
std::string MavlinkWriter::Pack(Encode encode) {
  mavlink_status_t status = {};
  status.current_tx_seq = sequence_++;
  mavlink_message_t message = {};
  encode(&status, &message);
  std::string bytes(MAVLINK_MAX_PACKET_LEN, '\0');
  bytes.resize(mavlink_msg_to_send_buffer(reinterpret_cast<uint8_t*>(bytes.data()), &message));
  return bytes;
}

std::string MavlinkWriter::Heartbeat(bool is_active) {
  mavlink_heartbeat_t heartbeat = {};
  heartbeat.type = MAV_TYPE_ONBOARD_CONTROLLER;
  heartbeat.autopilot = MAV_AUTOPILOT_INVALID;
  heartbeat.system_status = is_active ? MAV_STATE_ACTIVE : MAV_STATE_STANDBY;
  return Pack([&](mavlink_status_t* status, mavlink_message_t* message) {
    mavlink_msg_heartbeat_encode_status(system_id_, kComponent, status, message, &heartbeat);
  });
}

std::string MavlinkWriter::Odometry(const deepuav::Odometry& odometry, uint64_t time_us) {
  mavlink_odometry_t packed = {};
  packed.time_usec = time_us;
  packed.frame_id = MAV_FRAME_LOCAL_FRD;
  packed.child_frame_id = MAV_FRAME_BODY_FRD;
  const Eigen::Vector3f position = odometry.local_from_body.translation().cast<float>();
  packed.x = position.x(), packed.y = position.y(), packed.z = position.z();
  const Eigen::Quaternionf rotation = odometry.local_from_body.rotation().cast<float>();
  packed.q[0] = rotation.w(), packed.q[1] = rotation.x();
  packed.q[2] = rotation.y(), packed.q[3] = rotation.z();
  const Eigen::Vector3f velocity = odometry.velocity_body.cast<float>();
  packed.vx = velocity.x(), packed.vy = velocity.y(), packed.vz = velocity.z();
  const Eigen::Vector3f rates = odometry.turn_rate_body.cast<float>();
  packed.rollspeed = rates.x(), packed.pitchspeed = rates.y(), packed.yawspeed = rates.z();
  PackCovariance(odometry.pose_covariance, packed.pose_covariance);
  PackCovariance(odometry.velocity_covariance, packed.velocity_covariance);
  packed.reset_counter = odometry.reset_counter;
  packed.estimator_type = MAV_ESTIMATOR_TYPE_VISION;
  packed.quality = static_cast<int8_t>(odometry.quality);
  return Pack([&](mavlink_status_t* status, mavlink_message_t* message) {
    mavlink_msg_odometry_encode_status(system_id_, kComponent, status, message, &packed);
  });
}

std::string MavlinkWriter::VisionPosition(const deepuav::Odometry& odometry, uint64_t time_us) {
  mavlink_vision_position_estimate_t packed = {};
  packed.usec = time_us;
  const Eigen::Vector3f position = odometry.local_from_body.translation().cast<float>();
  packed.x = position.x(), packed.y = position.y(), packed.z = position.z();
  const Eigen::Vector3f angles = EulerAngles(odometry.local_from_body.rotation()).cast<float>();
  packed.roll = angles.x(), packed.pitch = angles.y(), packed.yaw = angles.z();
  PackCovariance(odometry.pose_covariance, packed.covariance);
  packed.reset_counter = odometry.reset_counter;
  return Pack([&](mavlink_status_t* status, mavlink_message_t* message) {
    mavlink_msg_vision_position_estimate_encode_status(system_id_, kComponent, status, message,
                                                       &packed);
  });
}

std::string MavlinkWriter::Timesync(int64_t clock_ns, int64_t mark_ns) {
  mavlink_timesync_t timesync = {};
  timesync.tc1 = clock_ns;
  timesync.ts1 = mark_ns;
  return Pack([&](mavlink_status_t* status, mavlink_message_t* message) {
    mavlink_msg_timesync_encode_status(system_id_, kComponent, status, message, &timesync);
  });
}

std::string MavlinkWriter::StatusText(std::string_view text, bool is_warning) {
  mavlink_statustext_t packed = {};
  packed.severity = is_warning ? MAV_SEVERITY_WARNING : MAV_SEVERITY_NOTICE;
  text.copy(packed.text, sizeof(packed.text));
  return Pack([&](mavlink_status_t* status, mavlink_message_t* message) {
    mavlink_msg_statustext_encode_status(system_id_, kComponent, status, message, &packed);
  });
}

std::string MavlinkWriter::GlobalOrigin(const GeoPoint& origin, int target_system,
                                        uint64_t time_us) {
  mavlink_set_gps_global_origin_t packed = {};
  packed.latitude = static_cast<int32_t>(std::lround(kDegreeParts * origin.latitude_deg));
  packed.longitude = static_cast<int32_t>(std::lround(kDegreeParts * origin.longitude_deg));
  packed.altitude = static_cast<int32_t>(std::lround(kMillimetres * origin.altitude_m));
  packed.target_system = static_cast<uint8_t>(target_system);
  packed.time_usec = time_us;
  return Pack([&](mavlink_status_t* status, mavlink_message_t* message) {
    mavlink_msg_set_gps_global_origin_encode_status(system_id_, kComponent, status, message,
                                                    &packed);
  });
}

namespace {

int NumberOf(RequestedMessage message) {
  switch (message) {
    case RequestedMessage::kHighresImu:
      break;
    case RequestedMessage::kScaledImu:
      return MAVLINK_MSG_ID_SCALED_IMU;
    case RequestedMessage::kGnss:
      return MAVLINK_MSG_ID_GPS_RAW_INT;
    case RequestedMessage::kGlobalOrigin:
      return MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN;
  }
  return MAVLINK_MSG_ID_HIGHRES_IMU;
}

}  // namespace

std::string MavlinkWriter::RequestMessage(RequestedMessage message, int target_system,
                                          double rate_hz) {
  constexpr double kMicroseconds = 1e6;
  mavlink_command_long_t packed = {};
  packed.command = MAV_CMD_SET_MESSAGE_INTERVAL;
  packed.target_system = static_cast<uint8_t>(target_system);
  packed.target_component = MAV_COMP_ID_AUTOPILOT1;
  packed.param1 = static_cast<float>(NumberOf(message));
  packed.param2 = static_cast<float>(kMicroseconds / rate_hz);
  return Pack([&](mavlink_status_t* status, mavlink_message_t* out) {
    mavlink_msg_command_long_encode_status(system_id_, kComponent, status, out, &packed);
  });
}

namespace {

GeoPoint OriginOf(const mavlink_message_t& message) {
  mavlink_gps_global_origin_t origin;
  mavlink_msg_gps_global_origin_decode(&message, &origin);
  return {origin.latitude / kDegreeParts, origin.longitude / kDegreeParts,
          origin.altitude / kMillimetres};
}

FixMessage FixOf(const mavlink_message_t& message) {
  mavlink_gps_raw_int_t fix;
  mavlink_msg_gps_raw_int_decode(&message, &fix);
  FixMessage found;
  found.system_id = message.sysid;
  found.has_place = fix.fix_type >= GPS_FIX_TYPE_3D_FIX && fix.fix_type <= GPS_FIX_TYPE_PPP;
  if (fix.time_usec <= static_cast<uint64_t>(std::numeric_limits<int64_t>::max()))
    found.time_us = static_cast<int64_t>(fix.time_usec);
  found.place = {fix.lat / kDegreeParts, fix.lon / kDegreeParts, fix.alt / kMillimetres};
  found.horizontal_sigma_m = fix.h_acc / kMillimetres;
  found.vertical_sigma_m = fix.v_acc / kMillimetres;
  return found;
}

InertialMessage HighresOf(const mavlink_message_t& message) {
  constexpr uint16_t kAllSix = 0x3f;  // Of accelerometer and gyroscope.
  mavlink_highres_imu_t imu;
  mavlink_msg_highres_imu_decode(&message, &imu);
  InertialMessage told;
  told.system_id = message.sysid;
  told.is_highres = true;
  told.sensor = imu.id;
  // Some say nothing of what they measured.
  told.is_measured = imu.fields_updated == 0 || (imu.fields_updated & kAllSix) == kAllSix;
  if (imu.time_usec <= static_cast<uint64_t>(std::numeric_limits<int64_t>::max()))
    told.time_us = static_cast<int64_t>(imu.time_usec);
  told.angular_velocity = Eigen::Vector3d(imu.xgyro, imu.ygyro, imu.zgyro);
  told.specific_force = Eigen::Vector3d(imu.xacc, imu.yacc, imu.zacc);
  return told;
}

InertialMessage ScaledOf(const mavlink_message_t& message) {
  constexpr double kMilli = 1e-3;
  mavlink_scaled_imu_t imu;
  mavlink_msg_scaled_imu_decode(&message, &imu);
  InertialMessage told;
  told.system_id = message.sysid;
  told.time_us = int64_t{1000} * imu.time_boot_ms;
  told.angular_velocity = kMilli * Eigen::Vector3d(imu.xgyro, imu.ygyro, imu.zgyro);
  told.specific_force =
      kMilli * kStandardGravity_m_s2 * Eigen::Vector3d(imu.xacc, imu.yacc, imu.zacc);
  return told;
}

void Tell(const mavlink_message_t& message, const MavlinkListener& listener) {
  if (message.compid != MAV_COMP_ID_AUTOPILOT1) return;
  switch (message.msgid) {
    case MAVLINK_MSG_ID_HEARTBEAT:
      if (mavlink_msg_heartbeat_get_autopilot(&message) != MAV_AUTOPILOT_INVALID)
        listener.heartbeat(message.sysid);
      break;
    case MAVLINK_MSG_ID_TIMESYNC:
      listener.timesync(mavlink_msg_timesync_get_tc1(&message),
                        mavlink_msg_timesync_get_ts1(&message));
      break;
    case MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN:
      listener.global_origin(message.sysid, OriginOf(message));
      break;
    case MAVLINK_MSG_ID_HIGHRES_IMU:
      if (listener.inertial) listener.inertial(HighresOf(message));
      break;
    case MAVLINK_MSG_ID_GPS_RAW_INT:
      if (listener.fix) listener.fix(FixOf(message));
      break;
    case MAVLINK_MSG_ID_SCALED_IMU:
      if (listener.inertial) listener.inertial(ScaledOf(message));
      break;
    default:
      break;
  }
}

}  // namespace

void ReadMavlink(std::string_view datagram, const MavlinkListener& listener) {
  mavlink_message_t incoming = {}, message = {};
  mavlink_status_t status = {}, message_status = {};
  int messages = 0;
  for (const char byte : datagram) {
    const uint8_t framing = mavlink_frame_char_buffer(
        &incoming, &status, static_cast<uint8_t>(byte), &message, &message_status);
    if (framing != MAVLINK_FRAMING_OK) continue;
    if (++messages > kMostMessages) return;
    Tell(message, listener);
  }
}

}  // namespace deepuav
