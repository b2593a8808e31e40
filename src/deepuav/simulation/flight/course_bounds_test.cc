#include <gmock/gmock.h>

#include <chrono>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/simulation/flight/flight_plan.h"
#include "deepuav/simulation/rendering/sensor.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const World& Plain() {
  static const World world([] {
    SceneOptions scene;
    scene.extent_m = 1200;
    scene.town_radius_m = 0;
    scene.forest_fraction = 0;
    scene.tree_fraction = 0;
    return scene;
  }());
  return world;
}

std::unique_ptr<FlightPath> Fly(const CourseOptions& course) {
  Random random(1);
  return PlanFlight(course, {}, {}, Plain(), &random);
}

TEST(Course, OfManyLapsIsPlannedInTimeThatGrowsWithItsLength) {
  CourseOptions course;
  course.laps = 25;
  const auto began = std::chrono::steady_clock::now();
  const auto path = Fly(course);
  EXPECT_GT(path->duration_s(), 1000);
  // A dense solution of its knots takes more than a minute.
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(45));
}

TEST(Course, ThatTakesHoursIsRefused) {
  CourseOptions course;
  course.laps = 150;
  EXPECT_THAT([&] { Fly(course); }, ThrowsMessage<Error>(HasSubstr("s to fly: expected at most")));
  course.laps = 1000;
  EXPECT_THAT([&] { Fly(course); }, ThrowsMessage<Error>(HasSubstr("km long: expected at most")));
}

TEST(Course, OfASpeedThatNeedsHalfACountryToTurnIsRefused) {
  CourseOptions course;
  course.speed_m_s = 100;
  course.acceleration_m_s2 = 3;
  EXPECT_THAT(
      [&] { course.Check(); },
      ThrowsMessage<Error>(HasSubstr("option course.speed_m_s is 100: expected at most 38.7")));
  course.acceleration_m_s2 = 20;
  EXPECT_NO_THROW(course.Check());
}

TEST(Course, ErrorsOfAKidnapNameItsOptions) {
  CourseOptions course;
  course.kidnap_at_s = 3000;
  EXPECT_THAT([&] { Fly(course); },
              ThrowsMessage<Error>(HasSubstr("option course.kidnap_at_s is 3000")));
}

/// At all bounds of what the sensor may be, a picture of any light is a picture.
TEST(SensorBounds, GiveAPicture) {
  for (const double well : {1.0, 1e9}) {
    for (const double noise : {0.0, 1e6}) {
      for (const double sunlit_s : {1e-7, 1.0}) {
        SensorOptions options;
        options.full_well_electrons = well;
        options.read_noise_electrons = noise;
        options.sunlit_exposure_s = sunlit_s;
        options.max_gain = 10'000;
        options.Check();
        const Sensor sensor(options, {16, 12}, 1, 1);
        for (const float light : {0.0f, 1.0f, 1e4f}) {
          cv::Mat1f radiance(12, 16, light);
          const ExposureSetting exposure = SettingFor(options, MeteredScale(options, {light}));
          EXPECT_EQ(sensor.Develop(radiance, exposure, 0).size(), cv::Size(16, 12));
        }
      }
    }
  }
}

/// Light that is no number is black, and no place outside the table of levels.
TEST(SensorBounds, LightThatIsNoNumberIsBlack) {
  SensorOptions options;
  options.defocus_px = 0;
  const Sensor sensor(options, {8, 8}, 1, 1);
  cv::Mat1f radiance(8, 8, std::numeric_limits<float>::quiet_NaN());
  const GreyImage image = sensor.Develop(radiance, {0.001, 1}, 0);
  EXPECT_EQ(cv::countNonZero(image), 0);
}

}  // namespace
}  // namespace deepuav
