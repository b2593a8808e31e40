#pragma once

#include <string>
#include <vector>

#include "deepuav/io/datasets/dataset.h"

namespace deepuav {

/// One of a dataset's sensors beside the camera, and what became of it.
struct SensorFacts {
  std::string name, source;
  size_t samples = 0;
  bool used = false;
  std::string note;  ///< Why not; empty where it was.
};

/// What a run uses beside the images.
struct SensorUse {
  SensorStreams streams;  ///< Of the sensors used alone.
  std::vector<SensorFacts> facts;
};

/// Throws WrongUse for a list that is not "auto" or of known sensors, the camera
/// among them.
void CheckSensorList(const std::string& list);

/// Reads the sensors that `list` names ("camera", "camera,imu", "camera,gnss,barometer,attitude"),
/// or under "auto" all that are there, where what cannot be read is left out with a warning. Throws
/// Error for a sensor that is named and not there.
SensorUse ReadSensorsUsed(const std::string& list, const Dataset& dataset);

/// The same of streams that were read.
SensorUse ChooseSensors(const std::string& list, SensorStreams streams);

}  // namespace deepuav
