#include "deepuav/io/datasets/euroc_writer.h"

#include <fmt/ranges.h>

#include "deepuav/base/error.h"
#include "deepuav/io/files/atomic_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error("{}: cannot be made: {}", folder.string(), error.message());
}

void WriteSensorFiles(const fs::path& folder, std::string_view yaml, const std::string& csv) {
  MakeFolder(folder);
  WriteFileAtomically(folder / "sensor.yaml", yaml);
  WriteFileAtomically(folder / "data.csv", csv);
}

std::string MatrixYaml(const SE3& body_from_sensor) {
  const Eigen::Matrix4d m = body_from_sensor.Matrix();
  std::string rows;
  for (int row = 0; row < 4; ++row) {
    rows += fmt::format("{}{:.15g}, {:.15g}, {:.15g}, {:.15g}", row == 0 ? "" : ",\n         ",
                        m(row, 0), m(row, 1), m(row, 2), m(row, 3));
  }
  return fmt::format("T_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\n", rows);
}

std::string SensorYaml(std::string_view type, const SE3& body_from_sensor) {
  return fmt::format("sensor_type: {}\n{}", type, MatrixYaml(body_from_sensor));
}

// The format knows two lenses; a pinhole is either without distortion.
std::string DistortionYaml(const Camera& camera) {
  const char* model = camera.lens == LensModel::kEquidistant ? "equidistant" : "radial-tangential";
  const std::vector<double> none(4, 0.0);
  const std::vector<double>& distortion =
      camera.lens == LensModel::kPinhole ? none : camera.distortion;
  return fmt::format("distortion_model: {}\ndistortion_coefficients: [{}]\n", model,
                     fmt::join(distortion, ", "));
}

std::string ReadoutYaml(const Camera& camera) {
  if (camera.readout_s == 0) return {};
  return fmt::format("readout_ms: {}  # of the rolling shutter, first row to last\n",
                     camera.readout_s * 1000);
}

std::string PoseCsv(Timestamp time, const SE3& pose) {
  const Eigen::Vector3d& p = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  return fmt::format("{},{:.12f},{:.12f},{:.12f},{:.15f},{:.15f},{:.15f},{:.15f}", time.nanoseconds,
                     p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
}

std::string VectorCsv(const Eigen::Vector3d& v) {
  return fmt::format(",{:.12f},{:.12f},{:.12f}", v.x(), v.y(), v.z());
}

}  // namespace

void WriteEurocCamera(const fs::path& mav0, const Camera& camera, const SE3& body_from_cam,
                      std::span<const EurocImageName> images) {
  const Pinhole& pinhole = camera.pinhole;
  const std::string yaml = fmt::format(
      "{}rate_hz: {}\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}]  "
      "# fu, fv, cu, cv\n{}{}",
      SensorYaml("camera", body_from_cam), camera.rate_hz, camera.width, camera.height, pinhole.fx,
      pinhole.fy, pinhole.cx, pinhole.cy, DistortionYaml(camera), ReadoutYaml(camera));
  std::string csv = "#timestamp [ns],filename\n";
  for (const EurocImageName& image : images)
    csv += fmt::format("{},{}\n", image.time.nanoseconds, image.file);
  WriteSensorFiles(mav0 / "cam0", yaml, csv);
}

void WriteEurocImu(const fs::path& mav0, double rate_hz, const ImuNoise& noise,
                   std::span<const ImuSample> samples) {
  const std::string yaml = fmt::format(
      "{}rate_hz: {}\n"
      "gyroscope_noise_density: {}  # rad / s / sqrt(Hz)\n"
      "gyroscope_random_walk: {}  # rad / s^2 / sqrt(Hz)\n"
      "accelerometer_noise_density: {}  # m / s^2 / sqrt(Hz)\n"
      "accelerometer_random_walk: {}  # m / s^3 / sqrt(Hz)\n",
      SensorYaml("imu", SE3()), rate_hz, noise.gyroscope_noise_density, noise.gyroscope_random_walk,
      noise.accelerometer_noise_density, noise.accelerometer_random_walk);
  std::string csv =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample : samples) {
    csv += fmt::format("{}{}{}\n", sample.time.nanoseconds, VectorCsv(sample.angular_velocity),
                       VectorCsv(sample.specific_force));
  }
  WriteSensorFiles(mav0 / "imu0", yaml, csv);
}

void WriteEurocGnss(const fs::path& mav0, double rate_hz, const Eigen::Vector3d& antenna_in_body_m,
                    std::span<const GnssFix> samples) {
  const std::string yaml = fmt::format(
      "{}rate_hz: {}\n", SensorYaml("gnss", SE3(Eigen::Quaterniond::Identity(), antenna_in_body_m)),
      rate_hz);
  std::string csv =
      "#timestamp [ns],latitude [deg],longitude [deg],altitude [m],std_east [m],std_north [m],"
      "std_up [m]\n";
  for (const GnssFix& sample : samples) {
    csv += fmt::format("{},{:.10f},{:.10f},{:.4f},{:.3f},{:.3f},{:.3f}\n", sample.time.nanoseconds,
                       sample.latitude_deg, sample.longitude_deg, sample.altitude_m.value_or(0),
                       sample.sigma_m.x(), sample.sigma_m.y(), sample.sigma_m.z());
  }
  WriteSensorFiles(mav0 / "gps0", yaml, csv);
}

void WriteEurocBarometer(const fs::path& mav0, double rate_hz,
                         std::span<const BarometerSample> samples) {
  const std::string yaml = fmt::format("{}rate_hz: {}\n", SensorYaml("barometer", SE3()), rate_hz);
  std::string csv = "#timestamp [ns],pressure [Pa],altitude [m]\n";
  for (const BarometerSample& sample : samples) {
    csv += fmt::format("{},{:.3f},{:.4f}\n", sample.time.nanoseconds, sample.pressure_pa,
                       sample.altitude_m);
  }
  WriteSensorFiles(mav0 / "baro0", yaml, csv);
}

void WriteEurocBodyTruth(const fs::path& mav0, std::span<const TimedBodyState> states) {
  std::string csv =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], "
      "b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], "
      "b_a_RS_S_z [m s^-2]\n";
  for (const TimedBodyState& state : states) {
    csv += PoseCsv(state.time, state.world_from_body) + VectorCsv(state.velocity_world) +
           VectorCsv(state.gyroscope_bias) + VectorCsv(state.accelerometer_bias) + '\n';
  }
  WriteSensorFiles(mav0 / "state_groundtruth_estimate0", SensorYaml("ground_truth", SE3()), csv);
  WriteFileAtomically(mav0 / "body.yaml", "comment: body x forward, y left, z up\n");
}

void WriteCameraTruth(const fs::path& dataset, const Trajectory& trajectory) {
  std::string csv =
      "#timestamp [ns],p_WC_x [m],p_WC_y [m],p_WC_z [m],q_WC_w [],q_WC_x [],q_WC_y [],q_WC_z []\n";
  for (const TimedPose& pose : trajectory) csv += PoseCsv(pose.time, pose.world_from_cam) + '\n';
  WriteFileAtomically(dataset / "groundtruth_cam0.csv", csv);
}

}  // namespace deepuav
