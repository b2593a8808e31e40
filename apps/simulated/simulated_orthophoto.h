#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "deepuav/simulation/world/world.h"
#include "simulated/simulation_options.h"

namespace deepuav {

/// Writes orthophoto.tif and dsm.tif into `folder`: the truth, of the ground below the cameras at
/// `positions` (world) and as far around as they see when they look straight down. In UTM, heights
/// above the ellipsoid. Throws Error.
void WriteTrueOrthophoto(const std::filesystem::path& folder, const World& world,
                         const SimulationOptions& options,
                         const std::vector<Eigen::Vector3d>& positions, double cell_m, int threads);

}  // namespace deepuav
