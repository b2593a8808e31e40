#pragma once

#include <unistd.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "deepuav/geometry/camera.h"
#include "deepuav/inference/session.h"

namespace deepuav {

inline std::string Port(int id, const std::string& name, int channels) {
  return fmt::format(
      R"(<port id="{}" precision="FP32"{}><dim>1</dim><dim>{}</dim><dim>-1</dim><dim>-1</dim></port>)",
      id, name.empty() ? "" : " names=\"" + name + "\"", channels);
}

/// A layer of one input.
inline std::string Layer(int id, const std::string& name, const std::string& type,
                         const std::string& version, const std::string& data, int channels_in,
                         int channels_out) {
  return fmt::format(
      R"(<layer id="{}" name="{}" type="{}" version="{}">{}<input>{}</input><output>{}</output></layer>)",
      id, name, type, version, data, Port(0, "", channels_in), Port(1, name, channels_out));
}

inline std::string Result(int id, int channels) {
  return fmt::format(
      R"(<layer id="{0}" name="r{0}" type="Result" version="opset1"><input>{1}</input></layer>)",
      id, Port(0, "", channels));
}

inline std::string Edge(int from, int from_port, int to, int to_port) {
  return fmt::format(R"(<edge from-layer="{}" from-port="{}" to-layer="{}" to-port="{}"/>)", from,
                     from_port, to, to_port);
}

/// A network without weights, in OpenVINO's format: the descriptor of a cell is its 64 pixels, and
/// the detector the image itself (`scores`), or the cell's pixels and their maximum as "no point"
/// (`logits`), or missing.
inline std::string ToyNetwork(const std::string& detector) {
  std::string layers = R"(<layer id="0" name="image" type="Parameter" version="opset1">)"
                       R"(<data shape="1,1,?,?" element_type="f32"/><output>)" +
                       Port(1, "image", 1) + "</output></layer>";
  layers += Layer(1, "desc", "SpaceToDepth", "opset1",
                  R"(<data mode="blocks_first" block_size="8"/>)", 1, 64);
  layers += Result(2, 64);
  std::string edges = Edge(0, 1, 1, 0) + Edge(1, 1, 2, 0);
  if (detector == "scores") {
    layers += Layer(3, "scores", "ReLU", "opset1", "", 1, 1) + Result(4, 1);
    edges += Edge(0, 1, 3, 0) + Edge(3, 1, 4, 0);
  } else if (detector == "logits") {
    layers += Layer(3, "largest", "MaxPool", "opset1",
                    R"(<data strides="8,8" pads_begin="0,0" pads_end="0,0" kernel="8,8" )"
                    R"(rounding_type="floor" auto_pad="explicit"/>)",
                    1, 1);
    layers +=
        R"(<layer id="4" name="logits" type="Concat" version="opset1"><data axis="1"/><input>)" +
        Port(0, "", 64) + Port(1, "", 1) + "</input><output>" + Port(2, "logits", 65) +
        "</output></layer>";
    layers += Result(5, 65);
    edges += Edge(0, 1, 3, 0) + Edge(1, 1, 4, 0) + Edge(3, 1, 4, 1) + Edge(4, 2, 5, 0);
  }
  return "<?xml version=\"1.0\"?><net name=\"toy\" version=\"11\"><layers>" + layers +
         "</layers><edges>" + edges + "</edges></net>";
}

inline Camera PinholeCamera(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.pinhole = {300, 300, 0.5 * (width - 1), 0.5 * (height - 1)};
  return camera;
}

inline InferenceOptions Fp32() {
  InferenceOptions options;
  options.precision = "fp32";
  return options;
}

/// Puts a whole file in place at once: tests that run at the same time may read it.
inline void PutFile(const std::filesystem::path& path, const std::string& content) {
  const std::filesystem::path unfinished = path.string() + "." + std::to_string(getpid());
  std::ofstream(unfinished) << content;
  std::filesystem::rename(unfinished, path);
}

/// Writes ToyNetwork(detector) into `folder` and returns the file.
inline std::string WriteToyNetwork(const std::filesystem::path& folder,
                                   const std::string& detector) {
  const auto path = folder / ("superpoint_toy_" + detector + ".xml");
  PutFile(std::filesystem::path(path).replace_extension(".bin"), std::string(8, '\0'));
  PutFile(path, ToyNetwork(detector));
  return path.string();
}

}  // namespace deepuav
