#include "deepuav/assembly/output/found_calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "deepuav/geometry/camera_scale.h"
#include "deepuav/geometry/lens_names.h"

namespace deepuav {
namespace {

constexpr double kMillisecondsASecond = 1000;
constexpr double kSigmasWorthSaying = 3;

std::string SigmaComment(const RefinedLens& lens, double fx) {
  const CalibrationSigmas& sigmas = lens.sigmas;
  const bool tells_focal = lens.is_focal_told && sigmas.focal > 0;
  if (!tells_focal && sigmas.k1 == 0) return "";
  std::string text = "# standard deviations: ";
  if (tells_focal) text += fmt::format("fx {:.3f} px, ", sigmas.focal * fx);
  text += fmt::format("k1 {:.6f}, k2 {:.6f}", sigmas.k1, sigmas.k2);
  if (sigmas.centre > 0) {
    text += fmt::format(", cx and cy {:.3f} px, p1 and p2 {:.6f}", sigmas.centre * fx,
                        sigmas.tangential);
  }
  return text + "\n";
}

std::string ReadoutComment(const RefinedLens& lens) {
  if (lens.readout_s == 0) return "";
  return fmt::format(
      "# rolling shutter: {:.4f} s from the first row to the last (standard deviation {:.5f})\n",
      lens.readout_s, lens.sigmas.readout_s);
}

}  // namespace

std::optional<RefinedLens> RefinedBy(const SlamResult& result, const Camera& camera,
                                     const std::optional<RefinedLens>& before) {
  std::optional<RefinedLens> lens = before;
  if (result.lens) {
    const double readout_sigma_s = before ? before->sigmas.readout_s : 0;
    lens = RefinedLens{*result.lens, before ? before->readout_s : 0};
    lens->sigmas.readout_s = readout_sigma_s;
  }
  if (result.readout) {
    if (!lens) lens.emplace();
    lens->readout_s = camera.readout_s;
    lens->sigmas.readout_s = result.readout->sigma_s;
  }
  return lens;
}

FoundCalibration DescribeCalibration(const Camera& stored, const std::string& source,
                                     const Camera& camera, const std::optional<RefinedLens>& lens) {
  return {ScaledCamera(camera, stored.width, stored.height), source, stored.pinhole.fx, lens};
}

std::string CalibrationYaml(const FoundCalibration& calibration) {
  const Camera& camera = calibration.camera;
  std::string yaml = fmt::format("# started from: {}, {:.1f} px\n", calibration.source,
                                 calibration.start_focal_px);
  if (const auto& lens = calibration.lens)
    yaml += SigmaComment(*lens, camera.pinhole.fx) + ReadoutComment(*lens);
  yaml += fmt::format(
      "model: {}\nwidth: {}\nheight: {}\nfx: {:.6f}\nfy: {:.6f}\ncx: {:.6f}\ncy: {:.6f}\n",
      NameOf(camera.lens), camera.width, camera.height, camera.pinhole.fx, camera.pinhole.fy,
      camera.pinhole.cx, camera.pinhole.cy);
  if (!camera.distortion.empty())
    yaml += fmt::format("distortion: [{:.9g}]\n", fmt::join(camera.distortion, ", "));
  if (camera.rate_hz > 0) yaml += fmt::format("rate_hz: {:.6g}\n", camera.rate_hz);
  if (camera.readout_s > 0)
    yaml += fmt::format("readout_ms: {:.6g}\n", kMillisecondsASecond * camera.readout_s);
  return yaml;
}

std::string CalibrationText(const FoundCalibration& calibration) {
  const double focal_px = calibration.camera.pinhole.fx;
  std::string text = fmt::format("focal length {:.1f} px", focal_px);
  if (const auto& lens = calibration.lens) {
    if (!lens->is_focal_told) {
      text += ", which the photographs don't tell";
    } else if (lens->sigmas.focal > 0) {
      text += fmt::format(" (standard deviation {:.2g})", lens->sigmas.focal * focal_px);
    }
    if (!calibration.camera.distortion.empty())
      text += fmt::format(", k1 {:.4f}", calibration.camera.distortion[0]);
    if (lens->sigmas.k1 > 0) text += fmt::format(" ({:.4f})", lens->sigmas.k1);
    if (lens->readout_s > kSigmasWorthSaying * lens->sigmas.readout_s)
      text += fmt::format(", rolling shutter {:.1f} ms", kMillisecondsASecond * lens->readout_s);
  }
  text += fmt::format("; from {}", calibration.source);
  constexpr double kWorthSaying = 0.2;
  if (std::abs(std::log(focal_px / calibration.start_focal_px)) > kWorthSaying)
    text += fmt::format(", which said {:.1f} px: wrong", calibration.start_focal_px);
  return text + "\n";
}

}  // namespace deepuav
