// An autopilot's position fixes, as they come in datagrams.
#include "deepuav/autopilot/autopilot_gnss.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/autopilot/testing/session_fixture.h"

namespace deepuav {
namespace {

mavlink_gps_raw_int_t Fix(int64_t time_us) {
  mavlink_gps_raw_int_t fix = {};
  fix.time_usec = static_cast<uint64_t>(time_us);
  fix.fix_type = GPS_FIX_TYPE_3D_FIX;
  fix.lat = 473977418, fix.lon = -85455940, fix.alt = 488'120;
  fix.h_acc = 900, fix.v_acc = 1'500;
  return fix;
}

std::string Datagram(const mavlink_gps_raw_int_t& fix, uint8_t system = kVehicle) {
  mavlink_status_t status = {};
  mavlink_message_t message = {};
  mavlink_msg_gps_raw_int_encode_status(system, MAV_COMP_ID_AUTOPILOT1, &status, &message, &fix);
  return Bytes(message);
}

class AutopilotGnssTest : public SessionFixture {
 protected:
  AutopilotGnssTest() { session_.emplace(Wanted(), kStart, Kept()); }

  static AutopilotOptions Wanted() {
    AutopilotOptions options;
    options.gnss.wanted = true;
    return options;
  }
  AutopilotListener Kept() {
    return {.fix = [this](const GnssFix& fix) { fixes_.push_back(fix); },
            .origin = [this](const GeoPoint& origin) { origins_.push_back(origin); }};
  }
  /// What is said for so long; a fix comes each fifth of a second where `fixes` says so.
  std::vector<mavlink_message_t> Run(double seconds, bool fixes) {
    std::vector<mavlink_message_t> all;
    const int64_t step = 200 * kMs;
    for (const int64_t end = now_ + std::llround(seconds * kSecond); now_ < end; now_ += step) {
      session_->Hear(HeartbeatFrom(kVehicle, MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
      if (fixes) Hear(Datagram(Fix(AutopilotUs())));
      for (const mavlink_message_t& message : Due()) all.push_back(message);
    }
    return all;
  }
  static int Texts(const std::vector<mavlink_message_t>& messages, const std::string& wanted) {
    return static_cast<int>(std::ranges::count_if(Of(messages, MAVLINK_MSG_ID_STATUSTEXT),
                                                  [&](const mavlink_message_t& message) {
                                                    char text[51] = {};
                                                    mavlink_msg_statustext_get_text(&message, text);
                                                    return text == wanted;
                                                  }));
  }
  static int Asked(const std::vector<mavlink_message_t>& messages, float number) {
    return static_cast<int>(std::ranges::count_if(
        Of(messages, MAVLINK_MSG_ID_COMMAND_LONG), [&](const mavlink_message_t& message) {
          return mavlink_msg_command_long_get_command(&message) == MAV_CMD_SET_MESSAGE_INTERVAL &&
                 mavlink_msg_command_long_get_param1(&message) == number;
        }));
  }

  std::vector<GnssFix> fixes_;
  std::vector<GeoPoint> origins_;
};

TEST_F(AutopilotGnssTest, AFixIsReadInItsUnits) {
  Meet();
  now_ += 150 * kMs;  // It comes so late.
  Hear(Datagram(Fix(AutopilotUs() - 150'000)));
  ASSERT_EQ(fixes_.size(), 1u);
  EXPECT_EQ(fixes_[0].time.nanoseconds, now_ - 150 * kMs);
  EXPECT_DOUBLE_EQ(fixes_[0].latitude_deg, 47.3977418);
  EXPECT_DOUBLE_EQ(fixes_[0].longitude_deg, -8.5455940);
  EXPECT_DOUBLE_EQ(fixes_[0].altitude_m.value(), 488.12);
  EXPECT_TRUE(fixes_[0].sigma_m.isApprox(Eigen::Vector3d(0.9, 0.9, 1.5)));
}

TEST_F(AutopilotGnssTest, ATimeOfAnotherClockIsTakenAsThatOfArrival) {
  Meet();
  Hear(Datagram(Fix(1'780'000'000'000'000)));  // Since 1970.
  now_ += 200 * kMs;
  Hear(Datagram(Fix(0)));
  ASSERT_EQ(fixes_.size(), 2u);
  EXPECT_EQ(fixes_[0].time.nanoseconds, now_ - 200 * kMs);
  EXPECT_EQ(fixes_[1].time.nanoseconds, now_);
}

TEST_F(AutopilotGnssTest, WhatIsNoPlaceIsLeftAside) {
  Meet();
  const auto hear = [&](auto change) {
    now_ += kSecond;
    mavlink_gps_raw_int_t fix = Fix(AutopilotUs());
    change(&fix);
    Hear(Datagram(fix));
  };
  hear([](auto* fix) { fix->fix_type = GPS_FIX_TYPE_2D_FIX; });
  hear([](auto* fix) { fix->fix_type = GPS_FIX_TYPE_NO_GPS; });
  hear([](auto* fix) { fix->lat = fix->lon = 0; });
  hear([](auto* fix) { fix->lat = 910'000'000; });
  hear([](auto* fix) { fix->lon = 1'900'000'000; });
  hear([](auto* fix) { fix->alt = -2'000'000; });
  hear([](auto* fix) { fix->h_acc = 26'000; });
  EXPECT_TRUE(fixes_.empty());
  hear([](auto* fix) { fix->fix_type = GPS_FIX_TYPE_RTK_FIXED, fix->h_acc = 14; });
  ASSERT_EQ(fixes_.size(), 1u);
  EXPECT_DOUBLE_EQ(fixes_[0].sigma_m.x(), 0.014);
}

TEST_F(AutopilotGnssTest, OneThatWasSentBeforeIsLeftAside) {
  Meet();
  const std::string datagram = Datagram(Fix(AutopilotUs()));
  Hear(datagram);
  now_ += 100 * kMs;
  Hear(datagram);
  EXPECT_EQ(fixes_.size(), 1u);
}

TEST_F(AutopilotGnssTest, OneThatIsSentAgainIsLeftAsideWhateverItsClock) {
  Meet();
  for (const int64_t time_us : {int64_t{1'780'000'000'000'000}, int64_t{0}}) {
    const std::string datagram = Datagram(Fix(time_us));
    for (int i = 0; i < 5; ++i) {
      now_ += 200 * kMs;
      Hear(datagram);
    }
  }
  EXPECT_EQ(fixes_.size(), 2u);
}

TEST_F(AutopilotGnssTest, StaysWithTheAutopilotThatWasHeardFirst) {
  Meet();
  session_->Hear(HeartbeatFrom(kOther, MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  Hear(Datagram(Fix(AutopilotUs()), kOther));
  EXPECT_TRUE(fixes_.empty());
  now_ += 10 * kSecond;  // Meanwhile the first one is gone.
  session_->Hear(HeartbeatFrom(kOther, MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  Hear(Datagram(Fix(AutopilotUs()), kOther));
  EXPECT_EQ(fixes_.size(), 1u);
}

TEST_F(AutopilotGnssTest, OnlyTheAutopilotsOwnAreTaken) {
  Hear(Datagram(Fix(AutopilotUs())));
  Hear(OriginFrom(kOther, 473'000'000, 85'000'000, 400'000));
  EXPECT_TRUE(fixes_.empty()) << "no heartbeat yet";
  EXPECT_TRUE(origins_.empty());
  Meet();
  Hear(Datagram(Fix(AutopilotUs()), kOther));
  Hear(OriginFrom(kOther, 473'000'000, 85'000'000, 400'000));
  EXPECT_TRUE(fixes_.empty());
  EXPECT_TRUE(origins_.empty());
  Hear(Datagram(Fix(AutopilotUs())));
  Hear(OriginFrom(kVehicle, 473'000'000, 85'000'000, 400'000));
  EXPECT_EQ(fixes_.size(), 1u);
  ASSERT_EQ(origins_.size(), 1u);
  EXPECT_DOUBLE_EQ(origins_[0].altitude_m, 400);
}

TEST_F(AutopilotGnssTest, WhoDoesNotWantThemNeitherAsksNorHears) {
  session_.emplace(AutopilotOptions{}, kStart, Kept());
  Meet();
  Hear(Datagram(Fix(AutopilotUs())));
  Hear(OriginFrom(kVehicle, 473'000'000, 85'000'000, 400'000));
  EXPECT_TRUE(fixes_.empty());
  EXPECT_TRUE(origins_.empty());
  EXPECT_TRUE(Of(Due(), MAVLINK_MSG_ID_COMMAND_LONG).empty());
}

TEST_F(AutopilotGnssTest, TheyAreAskedForUntilTheyCome) {
  Meet();
  const auto asked = Run(9, false);
  EXPECT_EQ(Asked(asked, MAVLINK_MSG_ID_GPS_RAW_INT), 3) << "at 0, 1 and 3 s; at 7 the fourth";
  EXPECT_EQ(Asked(asked, MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN), 3);
  now_ += 4 * kSecond;
  Run(4, true);
  const auto quiet = Run(20, true);
  EXPECT_EQ(Asked(quiet, MAVLINK_MSG_ID_GPS_RAW_INT), 0);
  EXPECT_GT(Asked(quiet, MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN), 0) << "which did not come";
}

TEST_F(AutopilotGnssTest, ThatTheyComeAndStopIsSaidOnce) {
  Meet();
  auto all = Run(5, true);
  for (const mavlink_message_t& message : Run(10, false)) all.push_back(message);
  EXPECT_EQ(Texts(all, "SLAM: position fixes of the autopilot"), 1);
  EXPECT_EQ(Texts(all, "SLAM: position fixes of the autopilot stopped"), 1);
  EXPECT_EQ(Texts(all, "SLAM: no position fixes"), 0);
}

TEST_F(AutopilotGnssTest, ThatNoneComeIsSaidOnce) {
  Meet();
  EXPECT_EQ(Texts(Run(60, false), "SLAM: no position fixes"), 1);
}

}  // namespace
}  // namespace deepuav
