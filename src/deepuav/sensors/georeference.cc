#include "deepuav/sensors/georeference.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/sensors/georeference_hypothesis.h"
#include "deepuav/sensors/georeference_refinement.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kSameSpread = 0.01, kSameOffset_s = 1e-6;
constexpr double kMuchWorse = 2;  // Over the other median: no matter of noise.
constexpr int kMaxRounds = 30;
constexpr double kMedianOfChi3 = 1.538;  // Median length of a vector of three standard normals.
constexpr double kMedianOfChi2 = 1.177, kMedianOfChi1 = 0.6745;
/// The clock offset is tried at these steps over this many standard deviations of its prior.
constexpr double kOffsetStep_s = 0.25, kOffsetSigmas = 2;
/// Over that on the scale: what the fixes leave open altogether counts as known so badly.
constexpr double kLeastInformation = 1e-12;
/// A spread below this share of what a fix is taken for is not believed.
constexpr double kLeastRatio = 0.05;

/// How far the residuals of some axes spread, over what they should.
double Spread(const PathEstimate& estimate, const PathPositions& positions,
              const std::vector<uint8_t>& outlier, const Eigen::Vector3d& antenna_cam_m,
              int first_axis, int axes) {
  std::vector<double> lengths;
  for (size_t i = 0; i < positions.size(); ++i) {
    if (outlier[i]) continue;
    const Eigen::Vector3d scaled =
        AntennaResidual(estimate, positions[i], antenna_cam_m).cwiseQuotient(positions[i].sigma_m);
    lengths.push_back(scaled.segment(first_axis, axes).norm());
  }
  if (lengths.empty()) return std::numeric_limits<double>::infinity();
  return Median(lengths) / (axes == 2 ? kMedianOfChi2 : kMedianOfChi1);
}

template <typename Timed>
std::string Span(const std::vector<Timed>& series) {
  if (series.empty()) return "nothing";
  return fmt::format("{:.1f} to {:.1f} s", series.front().time.seconds(),
                     series.back().time.seconds());
}

/// Iteratively reweighted: who is an outlier follows from the spread of the others.
class RobustFit {
 public:
  RobustFit(const Trajectory& path, const std::vector<LocalFix>& fixes,
            const Eigen::Vector3d& antenna_cam_m, const ClockPrior& clock, const GnssNoise& noise,
            const GeoreferenceOptions& options, const PlacePriors& known)
      : path_(path),
        fixes_(fixes),
        antenna_cam_m_(antenna_cam_m),
        clock_(clock),
        noise_(noise),
        options_(options),
        known_(known) {}

  /// Places the fixes on the path, at the clock offset of the best hypothesis.
  PathHypothesis Start() {
    const int steps = static_cast<int>(kOffsetSigmas * clock_.sigma_s / kOffsetStep_s);
    PathHypothesis best;
    double best_offset_s = clock_.offset_s;
    for (int i = -steps; i <= steps; ++i) {
      const double offset_s = clock_.offset_s + i * kOffsetStep_s;
      const PathPositions positions = PlaceOnPath(path_, fixes_, offset_s, options_.max_gap_s);
      const PathHypothesis hypothesis =
          BestHypothesis(positions, antenna_cam_m_, DownInWorld(positions));
      if (hypothesis.median < best.median) {
        best = hypothesis;
        best_offset_s = offset_s;
      }
    }
    PlaceAt(best_offset_s);
    return best;
  }

  /// From what Start() gave, as it is or turned upright.
  GeoreferenceAttempt Run(const PathHypothesis& start, bool upright) {
    if (std::isinf(start.median)) return {std::nullopt, TooFew()};
    PathEstimate estimate = start.estimate;
    if (upright) {
      estimate.local_from_world =
          Upright(estimate.local_from_world, found_.positions, DownInWorld(found_.positions));
    }
    double ratio = start.median / kMedianOfChi3;
    found_.horizontal_ratio = found_.vertical_ratio = Believed(ratio);
    for (int round = 0; round < kMaxRounds; ++round) {
      const std::vector<uint8_t> before = found_.outlier;
      const Eigen::Vector3d ratios_before = Ratios();
      MarkOutliers(estimate);
      if (found_.used() < options_.min_fixes) return {std::nullopt, TooFew()};
      estimate = Refine(estimate);
      const double shift_s = std::exchange(estimate.clock_shift_s, 0);
      PlaceAt(found_.clock_offset_s + shift_s);
      const bool spreads_alike = Ratios().isApprox(ratios_before, kSameSpread);
      if (before == found_.outlier && spreads_alike && std::abs(shift_s) < kSameOffset_s) break;
    }
    Conclude(estimate);
    return Judge();
  }

  /// Of the fixes from the path that Run() found.
  double MedianDistance() const {
    return Median(AntennaDistances({found_.local_from_world, 0}, found_.positions, antenna_cam_m_));
  }

 private:
  void PlaceAt(double offset_s) {
    found_.clock_offset_s = offset_s;
    found_.positions = PlaceOnPath(path_, fixes_, offset_s, options_.max_gap_s);
    if (found_.outlier.size() != found_.positions.size())
      found_.outlier.assign(found_.positions.size(), 0);
  }

  Eigen::Vector3d DownInWorld(const PathPositions& positions) const {
    const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
    if (known_.metric) return down;
    if (known_.orientation) return known_.orientation->local_from_world.conjugate() * down;
    return DownByCameras(positions);
  }

  /// What the spread says of the standard deviations.
  static double Believed(double ratio) { return std::max(ratio, kLeastRatio); }

  Eigen::Vector3d Ratios() const {
    return {found_.horizontal_ratio, found_.horizontal_ratio, found_.vertical_ratio};
  }

  void MarkOutliers(const PathEstimate& estimate) {
    for (size_t i = 0; i < found_.positions.size(); ++i) {
      const PositionOnPath& at = found_.positions[i];
      const Eigen::Vector3d scaled = AntennaResidual(estimate, at, antenna_cam_m_)
                                         .cwiseQuotient(at.sigma_m)
                                         .cwiseQuotient(Ratios());
      found_.outlier[i] = scaled.norm() > options_.outlier_sigmas;
    }
  }

  PathEstimate Refine(const PathEstimate& estimate) {
    CountIndependent();
    const GeoreferenceRefinement refinement(found_.positions, antenna_cam_m_, clock_,
                                            found_.clock_offset_s, options_, known_);
    const PathEstimate refined = refinement.Solve(estimate, PerSigma());
    found_.horizontal_ratio =
        Believed(Spread(refined, found_.positions, found_.outlier, antenna_cam_m_, 0, 2));
    found_.vertical_ratio =
        Believed(Spread(refined, found_.positions, found_.outlier, antenna_cam_m_, 2, 1));
    return refined;
  }

  void CountIndependent() {
    const double used = found_.used();
    found_.by_carrier = AreByCarrier(fixes_, noise_);
    if (found_.by_carrier) {
      found_.fixes_per_independent = 1;
      return;
    }
    const double duration_s =
        SecondsBetween(found_.positions.front().camera.time, found_.positions.back().camera.time);
    const double independent =
        noise_.correlation_s > 0 ? 1 + duration_s / (2 * noise_.correlation_s) : used;
    found_.fixes_per_independent = std::max(1.0, used / independent);
  }

  std::vector<Eigen::Vector3d> PerSigma() const {
    std::vector<Eigen::Vector3d> per_sigma(found_.positions.size(), Eigen::Vector3d::Zero());
    for (size_t i = 0; i < per_sigma.size(); ++i) {
      if (!found_.outlier[i]) per_sigma[i] = found_.IndependentSigma(i).cwiseInverse();
    }
    return per_sigma;
  }

  void Conclude(const PathEstimate& estimate) {
    found_.local_from_world = estimate.local_from_world;
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < found_.positions.size(); ++i) {
      if (!found_.outlier[i])
        squares += AntennaResidual(estimate, found_.positions[i], antenna_cam_m_).cwiseAbs2();
    }
    squares /= found_.used();
    found_.horizontal_rms_m = std::sqrt(squares.x() + squares.y());
    found_.vertical_rms_m = std::sqrt(squares.z());
    const GeoreferenceRefinement refinement(found_.positions, antenna_cam_m_, clock_,
                                            found_.clock_offset_s, options_, known_);
    Matrix8d information = refinement.Information(estimate, PerSigma());
    // Else nothing could be said of what they do tell.
    information.diagonal().array() += kLeastInformation * information(kLogScale, kLogScale);
    const Eigen::LLT<Matrix8d> factor(information);
    found_.covariance = factor.info() == Eigen::Success
                            ? Matrix8d(factor.solve(Matrix8d::Identity()))
                            : Matrix8d(Matrix8d::Constant(1e12));
  }

  std::string TooFew() const {
    return fmt::format(
        "{} of {} fixes lie on the path of the camera: expected at least {}; the fixes span {}, "
        "the path {}",
        found_.used(), fixes_.size(), options_.min_fixes, Span(fixes_), Span(path_));
  }

  GeoreferenceAttempt Judge() const {
    const double scale_sigma = found_.scale_sigma();
    if (!(scale_sigma <= options_.max_scale_sigma)) {
      return {std::nullopt,
              fmt::format("the flight is too short for its fixes: they leave the scale open by "
                          "{:.0f} %, expected at most {:.0f} %",
                          100 * scale_sigma, 100 * options_.max_scale_sigma)};
    }
    const double turn_sigma_deg = found_.turn_sigma_rad() / kDegree;
    if (!(turn_sigma_deg <= options_.max_turn_sigma_deg)) {
      return {std::nullopt,
              fmt::format("the flight is too straight or too short for its fixes: they leave the "
                          "orientation open by {:.1f} degrees, expected at most {:.1f}",
                          turn_sigma_deg, options_.max_turn_sigma_deg)};
    }
    return {found_, ""};
  }

  const Trajectory& path_;
  const std::vector<LocalFix>& fixes_;
  const Eigen::Vector3d antenna_cam_m_;
  const ClockPrior clock_;
  const GnssNoise noise_;
  const GeoreferenceOptions options_;
  const PlacePriors& known_;
  Georeference found_;
};

}  // namespace

void GeoreferenceOptions::Check() const { CheckOptions("sensors.georeference", *this); }

int Georeference::used() const {
  return static_cast<int>(std::count(outlier.begin(), outlier.end(), 0));
}

double Georeference::scale_sigma() const { return std::sqrt(covariance(kLogScale, kLogScale)); }

double Georeference::turn_sigma_rad() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance.block<3, 3>(kTurn, kTurn));
  return std::sqrt(axes.eigenvalues().maxCoeff());
}

Eigen::Matrix3d Georeference::PositionCovariance(const Eigen::Vector3d& world) const {
  const Eigen::Vector3d arm = local_from_world * world - local_from_world.translation();
  Eigen::Matrix<double, 3, 8> jacobian;
  jacobian << -Skew(arm), Eigen::Matrix3d::Identity(), arm, Eigen::Vector3d::Zero();
  return jacobian * covariance * jacobian.transpose();
}

Eigen::Vector3d Georeference::IndependentSigma(size_t i) const {
  const PositionOnPath& at = positions[i];
  Eigen::Vector3d ratio(horizontal_ratio, horizontal_ratio, vertical_ratio);
  // What a receiver states holds until the path shows it to be too small: a short flight does not
  // see how slowly its errors change.
  if (at.sigma_is_stated) ratio = ratio.cwiseMax(1);
  return std::sqrt(fixes_per_independent) * at.sigma_m.cwiseProduct(ratio);
}

bool AreByCarrier(const std::vector<LocalFix>& fixes, const GnssNoise& noise) {
  const auto stating = std::count_if(fixes.begin(), fixes.end(), [&](const LocalFix& fix) {
    return fix.sigma_is_stated && fix.sigma_m.head<2>().maxCoeff() < noise.carrier_sigma_m;
  });
  return 2 * stating > std::ssize(fixes);
}

GeoreferenceAttempt FindGeoreference(const Trajectory& path, const std::vector<LocalFix>& fixes,
                                     const Eigen::Vector3d& antenna_cam_m, const ClockPrior& clock,
                                     const GnssNoise& noise, const GeoreferenceOptions& options,
                                     const PlacePriors& known) {
  noise.Check();
  options.Check();
  RobustFit upright(path, fixes, antenna_cam_m, clock, noise, options, known);
  const PathHypothesis start = upright.Start();
  RobustFit as_found = upright;
  GeoreferenceAttempt attempt = upright.Run(start, true), other = as_found.Run(start, false);
  if (!attempt.found) return other;
  const bool fixes_contradict =
      other.found && kMuchWorse * as_found.MedianDistance() < upright.MedianDistance();
  return fixes_contradict ? other : attempt;
}

}  // namespace deepuav
