// What tests/library_test.py asks of the installed library, from a program of its own:
//   consumer run SEQUENCE OUT SCHEDULE none|slow|throwing    prints "frames keyframes maps dropped"
//   consumer survey PHOTOGRAPHS OUT                          the same
//   consumer stopped SEQUENCE                                prints the number of frames of a run
//   that is stopped early
//   consumer samples SEQUENCE SCHEDULE COUNT                 prints the summary of a run that is
//   fed so many samples of each sensor consumer match A B prints the matches consumer misuse
//   SEQUENCE MAP                             exits with 0 where all is refused as it should
//   consumer memory SEQUENCE MAP                             exits with 0 where a lack of memory is
//   told as any error
#include <deepuav/api/evaluate.h>
#include <deepuav/api/map.h>
#include <deepuav/api/match.h>
#include <deepuav/api/slam.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <new>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#if !defined(__SANITIZE_ADDRESS__)  // Which has its own.
namespace {
/// The next allocation of this thread fails.
thread_local bool memory_is_short = false;
}  // namespace

void* operator new(std::size_t size) {
  void* memory = memory_is_short ? nullptr : std::malloc(size > 0 ? size : 1);
  memory_is_short = false;
  if (memory) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace {

namespace api = deepuav::api;

struct Line {
  std::int64_t time_ns = 0;
  std::vector<std::string> fields;
};

std::vector<Line> ReadCsv(const std::string& file) {
  std::vector<Line> lines;
  std::ifstream stream(file);
  for (std::string text; std::getline(stream, text);) {
    if (text.empty() || text[0] == '#') continue;
    std::istringstream fields(text);
    Line line;
    std::string field;
    std::getline(fields, field, ',');
    line.time_ns = std::stoll(field);
    while (std::getline(fields, field, ',')) line.fields.push_back(field);
    lines.push_back(line);
  }
  return lines;
}

api::ImageView ViewOf(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step),
          image.channels() == 1 ? api::PixelFormat::kGrey8 : api::PixelFormat::kBgr8};
}

/// Counts what it is told, slower than it happens.
class Watcher : public api::Observer {
 public:
  explicit Watcher(const std::string& manner) : manner_(manner) {}
  void OnFrame(const api::FrameEvent& event) override {
    if (event.frame.id <= last_frame_) std::abort();  // out of order
    last_frame_ = event.frame.id;
    ++frames;
    constexpr std::chrono::milliseconds kSlow(40);
    if (manner_ == "slow") std::this_thread::sleep_for(kSlow);
    if (manner_ == "throwing") throw std::runtime_error("an observer's own mistake");
  }
  void OnKeyframe(const api::KeyframeEvent& event) override {
    ++keyframes;
    landmarks += static_cast<int>(event.new_landmarks_world.size());
  }
  void OnMap(const api::MapEvent& event) override {
    maps += event.change == api::MapChange::kStarted;
  }
  void OnDropped(std::int64_t count) override { dropped += count; }

  std::int64_t dropped = 0;
  int frames = 0, keyframes = 0, maps = 0, landmarks = 0;

 private:
  const std::string manner_;
  std::int64_t last_frame_ = -1;
};

void FeedImuUntil(std::int64_t time_ns, const std::vector<Line>& samples, std::size_t* next,
                  api::Slam* slam) {
  for (; *next < samples.size() && samples[*next].time_ns <= time_ns; ++*next) {
    const Line& sample = samples[*next];
    const auto value = [&](std::size_t i) { return std::stod(sample.fields[i]); };
    slam->FeedImu({sample.time_ns, {value(0), value(1), value(2)}, {value(3), value(4), value(5)}});
  }
}

int Run(const std::string& sequence, const std::string& out, const std::string& schedule,
        const std::string& manner) {
  const std::string camera = sequence + "/mav0/cam0/";
  const std::vector<Line> samples = ReadCsv(sequence + "/mav0/imu0/data.csv");
  Watcher watcher(manner);
  api::RunSetup setup;
  setup.schedule = schedule;
  if (!samples.empty())
    setup.imu = api::ReadImuSensor(camera + "sensor.yaml", sequence + "/mav0/imu0/sensor.yaml");
  if (manner != "none") setup.observer = &watcher;
  api::Slam slam(api::ReadCamera(camera + "sensor.yaml"), {}, setup);
  std::size_t next = 0;
  std::int64_t before_ns = std::numeric_limits<std::int64_t>::min();
  for (const Line& line : ReadCsv(camera + "data.csv")) {
    const cv::Mat image = cv::imread(camera + "data/" + line.fields[0], cv::IMREAD_GRAYSCALE);
    slam.Feed(ViewOf(image), line.time_ns);
    FeedImuUntil(before_ns, samples, &next, &slam);  // one image late
    before_ns = line.time_ns;
  }
  FeedImuUntil(std::numeric_limits<std::int64_t>::max(), samples, &next, &slam);
  const api::Result result = slam.Finish();
  result.Write(out);
  std::cout << watcher.frames << " " << watcher.keyframes << " " << watcher.maps << " "
            << watcher.landmarks << " " << watcher.dropped << "\n";
  return result.Failure().empty() ? 0 : 1;
}

int Survey(const std::string& photographs, const std::string& out) {
  Watcher watcher("slow");
  api::DatasetSetup setup;
  setup.dataset = photographs;
  setup.observer = &watcher;
  const api::Result result = api::Run(setup);
  result.Write(out);
  std::cout << watcher.frames << " " << watcher.keyframes << " " << watcher.maps << " "
            << watcher.landmarks << " " << watcher.dropped << "\n";
  return result.Failure().empty() ? 0 : 1;
}

int Stopped(const std::string& sequence) {
  constexpr int kLooks = 10;
  std::atomic<int> looks{0};
  api::DatasetSetup setup;
  setup.dataset = sequence;
  setup.stop = [&looks] { return ++looks > kLooks; };
  std::cout << api::Run(setup).Frames().size() << "\n";
  return 0;
}

int Samples(const std::string& sequence, const std::string& schedule, int count) {
  api::RunSetup setup;
  setup.schedule = schedule;
  setup.imu.emplace();
  api::Slam slam(api::ReadCamera(sequence + "/mav0/cam0/sensor.yaml"), {}, setup);
  for (int i = 0; i < count; ++i) {
    slam.FeedImu({i, {}, {0, 0, 9.8}});
    slam.FeedFix({i, 47, 8, 400, {}});
    slam.FeedBarometer({i, 400});
  }
  std::cout << slam.Finish().SummaryJson();
  return 0;
}

int Match(const std::string& a, const std::string& b) {
  api::Matcher matcher;
  const cv::Mat image_a = cv::imread(a, cv::IMREAD_COLOR), image_b = cv::imread(b);
  const auto from_files = matcher.Match(a, b);
  const auto from_pixels = matcher.Match(ViewOf(image_a), ViewOf(image_b));
  if (from_files.size() != from_pixels.size()) return 1;
  for (const api::PointMatch& match : from_files) {
    std::cout << std::fixed << std::setprecision(3) << match.ax << " " << match.ay << " "
              << match.bx << " " << match.by << " " << std::setprecision(4) << match.score << "\n";
  }
  return 0;
}

/// Whether it throws api::Error with these words.
bool Refused(const char* words, const std::function<void()>& act) {
  try {
    act();
  } catch (const api::Error& error) {
    if (std::string(error.what()).find(words) != std::string::npos) return true;
    std::cerr << "expected '" << words << "': " << error.what() << "\n";
    return false;
  }
  std::cerr << "expected '" << words << "': nothing was thrown\n";
  return false;
}

int Misuse(const std::string& sequence, const std::string& map_file) {
  const api::Camera camera = api::ReadCamera(sequence + "/mav0/cam0/sensor.yaml");
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width) *
                                         static_cast<std::size_t>(camera.height));
  const api::ImageView image{pixels.data(), camera.width, camera.height};
  api::Options options;
  bool good = Refused("the nearest", [&] { options.Set("features.keypoint", "8"); });
  good &= Refused("features.keypoints", [&] { options.Set("features.keypoints", "many"); });
  good &= Refused("absent", [&] { api::Map::Load("absent.deepuav"); });
  good &= Refused("absent", [&] { api::ReadCamera("absent.yaml"); });
  good &= Refused("width", [&] { api::Slam slam(api::Camera{}); });
  api::RunSetup setup;
  setup.schedule = "soon";
  good &= Refused("soon", [&] { api::Slam slam(camera, {}, setup); });
  good &= Refused("align", [&] {
    api::EvaluationSetup wrong;
    wrong.align = "closely";
    api::Evaluate(std::vector<api::TimedPose>{}, {}, wrong);
  });
  api::Slam slam(camera);
  slam.Feed(image, 1);
  good &= Refused("later time", [&] { slam.Feed(image, 1); });
  good &= Refused("expected pixels", [&] { slam.Feed({}, 2); });
  good &= Refused("320x240", [&] { slam.Feed({pixels.data(), 8, 8}, 2); });
  good &= Refused("inertial", [&] { slam.FeedImu({}); });
  good &= Refused("latitude", [&] { slam.FeedFix({1, 91, 0, {}, {}}); });
  slam.Finish();
  good &= Refused("finished", [&] { slam.Feed(image, 3); });
  good &= Refused("finished", [&] { slam.Finish(); });
  { const api::Slam given_up(camera); }
  const api::Map map = api::Map::Load(map_file);
  good &= !map.Keyframes().empty() && !map.Landmarks().empty() && map.Maps().size() == 1;
  good &= map.MapCamera().width == camera.width;
  return good ? 0 : 1;
}

#if !defined(__SANITIZE_ADDRESS__)
int Memory(const std::string& sequence, const std::string& map_file) {
  const api::Map map = api::Map::Load(map_file);
  api::DatasetSetup setup;
  setup.dataset = sequence;
  const api::Result result = api::Run(setup);
  const api::Options options;
  const auto told = [](const auto& act) {
    return Refused("bad_alloc", [&] {
      memory_is_short = true;
      act();
    });
  };
  bool good = told([&] { map.Keyframes(); }) && told([&] { map.Landmarks(); });
  good &= told([&] { map.Maps(); }) && told([&] { map.MapCamera(); });
  good &= told([&] { result.Frames(); }) && told([&] { result.Keyframes(); });
  good &= told([&] { result.Landmarks(); }) && told([&] { result.Maps(); });
  good &= told([&] { result.MainMap(); }) && told([&] { result.FinalCamera(); });
  good &= told([&] { options.List(); }) && told([&] { const api::Options copy(options); });
  return good ? 0 : 1;
}
#endif

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.at(0) == "run") return Run(words.at(1), words.at(2), words.at(3), words.at(4));
  if (words.at(0) == "survey") return Survey(words.at(1), words.at(2));
  if (words.at(0) == "stopped") return Stopped(words.at(1));
  if (words.at(0) == "samples") return Samples(words.at(1), words.at(2), std::stoi(words.at(3)));
  if (words.at(0) == "match") return Match(words.at(1), words.at(2));
#if !defined(__SANITIZE_ADDRESS__)
  if (words.at(0) == "memory") return Memory(words.at(1), words.at(2));
#endif
  return Misuse(words.at(1), words.at(2));
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
