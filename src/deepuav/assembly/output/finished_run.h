#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "deepuav/assembly/output/run_output.h"
#include "deepuav/system/photos/survey_telling.h"

namespace deepuav {

/// What a run leaves behind, however it was done.
struct FinishedRun {
  SlamResult result;
  Atlas atlas;
  Camera camera;  ///< As refined, of the images as they were worked on.
  RunFacts facts;
};

/// Who is told of a run while it goes on, and may end it.
struct RunHooks {
  /// After each frame, in the run's thread, with a word on how it goes.
  std::function<void(FrameId frame, const std::string& state)> progress = {};
  /// So many of all `what` (a plural) are done: of photographs that are made a map all at once,
  /// after the last of them, and of a run that begins anew.
  SurveyTelling::Work work = {};
  std::function<bool()> stop = {};  ///< Asked in any thread.
  RunObserver* observer = nullptr;
};

/// As WriteRunOutput.
inline void WriteRunOutput(const std::filesystem::path& folder, const FinishedRun& run) {
  WriteRunOutput(folder, run.atlas, run.camera, run.result, run.facts);
}

}  // namespace deepuav
