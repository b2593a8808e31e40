#pragma once

#include <filesystem>
#include <memory>
#include <openvino/openvino.hpp>
#include <string>

namespace deepuav {

/// The runtime: one of the process.
ov::Core& Core();

/// The runtime's messages span lines, first where in its sources, last what is wrong.
std::string LastLine(const std::string& message);

/// Throws Error naming the file where it is missing, has no weights beside it or is no network.
std::shared_ptr<ov::Model> ReadModel(const std::filesystem::path& model);

bool IsQuantised(const ov::Model& model);

/// Of the values of all weights: the file may name others that hold them.
std::string WeightsSha256(const ov::Model& model);

}  // namespace deepuav
