// SLAM over the images of an EuRoC sequence, which are read here and pushed into the library:
//   slam_euroc SEQUENCE OUT
#include <deepuav/api/slam.h>

#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <string>

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "slam_euroc: expected SEQUENCE OUT\n";
    return 2;
  }
  const std::string camera = std::string(argv[1]) + "/mav0/cam0/";
  deepuav::api::Options options;
  options.Set("features.size", "small");
  deepuav::api::Slam slam(deepuav::api::ReadCamera(camera + "sensor.yaml"), options);

  std::ifstream list(camera + "data.csv");
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t comma = line.find(',');
    const std::string name = line.substr(comma + 1, line.find_last_not_of("\r ") - comma);
    const cv::Mat image = cv::imread(camera + "data/" + name, cv::IMREAD_GRAYSCALE);
    slam.Feed({image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)},
              std::stoll(line));
  }
  const deepuav::api::Result result = slam.Finish();
  result.Write(argv[2]);
  for (const deepuav::api::MapInfo& map : result.Maps()) {
    std::cout << "map " << map.id << ": " << map.keyframes << " keyframes, " << map.landmarks
              << " landmarks\n";
  }
  return 0;
} catch (const deepuav::api::Error& error) {
  std::cerr << "slam_euroc: " << error.what() << "\n";
  return 1;
}
