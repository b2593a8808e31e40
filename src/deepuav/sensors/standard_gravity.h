#pragma once

namespace deepuav {

/// ISO 80000-3: what an accelerometer's unit g stands for, and what is assumed where a flight's own
/// gravity is not known.
constexpr double kStandardGravity_m_s2 = 9.80665;

}  // namespace deepuav
