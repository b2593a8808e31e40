// The shipped flights as they are flown.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "deepuav/base/random.h"
#include "deepuav/simulation/flight/flight_plan.h"
#include "deepuav/simulation/world/world.h"
#include "simulated/simulation_options.h"

namespace deepuav {
namespace {

SimulationOptions Load(const std::string& flight) {
  SimulationOptions options;
  OptionRegistry registry;
  options.Register(&registry);
  LoadSimulation({DEEPUAV_FLIGHTS "/" + flight + ".yaml", "", {}}, &options, &registry);
  return options;
}

TEST(SimulatedFlights, ComeThroughNothingThatStandsInAHall) {
  for (const std::string flight : {"facade", "hall", "rooms"}) {
    const SimulationOptions options = Load(flight);
    const World world(options.scene);
    for (uint64_t seed = 1; seed <= 9; ++seed) {
      Random random(seed);
      const auto path = PlanFlight(options.course, options.attitude, options.wind, world, &random);
      const double end_s = std::min(path->duration_s(), options.flight.duration_s);
      double least_m = 10;
      for (double t = 0; t < end_s; t += 0.05) {
        const Eigen::Vector3d p = path->At(t).world_from_body.translation();
        least_m = std::min(least_m, p.z() - world.ClearanceHeight(p.x(), p.y()));
      }
      EXPECT_GT(least_m, 0.1) << flight << " with wind " << seed;
    }
  }
}

}  // namespace
}  // namespace deepuav
