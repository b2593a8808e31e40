#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "deepuav/simulation/flight/flight_path.h"
#include "deepuav/simulation/rendering/renderer.h"
#include "deepuav/simulation/world/world.h"
#include "simulated/simulation_options.h"

namespace deepuav {

/// Writes a simulated flight as a dataset of EuRoC's layout. What is there already and complete is
/// kept, so that an interrupted flight goes on; a frame depends on the options alone, not on what
/// was made before it.
class SimulatedDataset {
 public:
  /// Makes world and flight. `threads` render; 0: as many as there are cores. Throws Error for
  /// options that do not fit one another, as a course that leaves the scene.
  SimulatedDataset(const SimulationOptions& options, const std::filesystem::path& folder,
                   int threads);

  int frame_count() const { return frame_count_; }
  double duration_s() const { return duration_s_; }

  /// `options_yaml` as simulation.yaml, calibration, IMU, GNSS, barometer and the truth. Throws
  /// Error where the folder holds another flight, or files cannot be written.
  void WriteSensors(const std::string& options_yaml) const;

  /// From now on frames come with masks of what moves in them, also frames that are there already.
  /// Throws Error where they cannot be written.
  void AddMovingMasks();

  /// Renders and writes a frame with what else was asked for. False where it was there.
  bool WriteFrame(int frame);

  /// The true orthophoto and DSM below the first `frames` frames, in cells of `cell_m`.
  void WriteOrthophoto(int frames, double cell_m) const;

  /// The list of the first `frames` frames.
  void WriteFrameList(int frames) const;

 private:
  double FrameTime(int frame) const { return frame / camera_.rate_hz; }
  std::string FrameName(int frame) const;
  void WriteCameraTruthFile() const;
  void WriteTruthSensors() const;
  void WriteImuAndBodyTruth() const;
  TruthRequest RequestFor(int frame) const;

  const SimulationOptions options_;
  const std::filesystem::path folder_, mav0_;
  const int threads_;
  const Camera camera_;
  const SE3 body_from_cam_;
  const World world_;
  const std::unique_ptr<FlightPath> path_;
  Renderer renderer_;
  bool moving_masks_ = false;
  double duration_s_ = 0;
  int frame_count_ = 0;
};

}  // namespace deepuav
