#include "deepuav/viewer/viewers.h"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>

#include "deepuav/viewer/asio_terms.h"

namespace deepuav {
namespace {

constexpr double kIdlePause = 0.025;        // Seconds before the model is asked again.
constexpr size_t kMostMessageBytes = 1024;  // From clients.
// Who reads answers a ping, as browsers do by themselves, after what was sent before.
constexpr double kAskInterval = 1, kPatience = 4;

}  // namespace

bool Viewers::HaveRoom() const {
  return viewers_.size() < static_cast<size_t>(options_.most_viewers) || Slowest();
}

/// Newcomers have shown nothing yet, so that many who read nothing only take one another's places.
Viewers::ViewerPtr Viewers::Slowest() const {
  ViewerPtr slowest;
  for (const ViewerPtr& viewer : viewers_) {
    const double since_shown = viewer->since_shown.Seconds();
    if (viewer->has_shown_once && since_shown <= kPatience) continue;
    if (!slowest || since_shown > slowest->since_shown.Seconds()) slowest = viewer;
  }
  return slowest;
}

void Viewers::MakeRoom() {
  if (viewers_.size() < static_cast<size_t>(options_.most_viewers)) return;
  const ViewerPtr slowest = Slowest();
  if (!slowest) return;
  viewers_.erase(slowest);
  Close(slowest.get());
}

void Viewers::ShutOutBlocked() const {
  for (const ViewerPtr& viewer : viewers_) {
    if (viewer->since_write_began &&
        viewer->since_write_began->Seconds() > options_.write_timeout_s)
      Close(viewer.get());
  }
}

Viewers::Task<> Viewers::Watch(Stream stream, Request request) {
  MakeRoom();
  auto viewer = std::make_shared<Viewer>(std::move(stream));
  viewers_.insert(viewer);
  Prepare(viewer.get());
  error_code problem;
  co_await viewer->socket.async_accept(request, Telling(&problem));
  if (!problem) {
    model_->CountWatchers(+1);
    asio::co_spawn(*context_, Listen(viewer), asio::detached);
    co_await SendAll(viewer);
    model_->CountWatchers(-1);
  }
  viewers_.erase(viewer);
  Close(viewer.get());
}

void Viewers::Prepare(Viewer* viewer) {
  auto& socket = viewer->socket;
  beast::get_lowest_layer(socket).expires_never();
  socket.set_option(websocket::stream_base::timeout{InSeconds(options_.request_timeout_s),
                                                    InSeconds(options_.silence_timeout_s), true});
  socket.read_message_max(kMostMessageBytes);
  socket.control_callback([this, viewer](websocket::frame_type kind, beast::string_view payload) {
    CountMessage(viewer);
    if (kind == websocket::frame_type::pong) TakeAnswer(payload, viewer);
  });
}

Viewers::Task<> Viewers::Listen(ViewerPtr viewer) {
  beast::flat_buffer buffer(kMostMessageBytes);
  while (!viewer->is_over) {
    error_code problem;
    co_await viewer->socket.async_read(buffer, Telling(&problem));
    if (problem) Close(viewer.get());
    buffer.clear();
    CountMessage(viewer.get());
  }
}

Viewers::Task<> Viewers::SendAll(ViewerPtr viewer) {
  ViewCursor cursor;
  asio::steady_timer timer(*context_);
  bool goes_on = co_await Ask(viewer.get());
  while (goes_on && !viewer->is_over) {
    if (viewer->question.empty() && viewer->since_shown.Seconds() > kAskInterval) {
      goes_on = co_await Ask(viewer.get());
      continue;
    }
    error_code problem;
    const std::optional<ViewMessage> message = model_->Next(&cursor);
    if (message) {
      goes_on = co_await Send(viewer.get(), *message);
    } else if (is_end_) {
      co_await viewer->socket.async_close(websocket::close_code::going_away, Telling(&problem));
      goes_on = false;
    } else {
      timer.expires_after(InSeconds(kIdlePause));
      co_await timer.async_wait(Telling(&problem));
    }
  }
  viewer->is_over = true;
}

Viewers::Task<bool> Viewers::Send(Viewer* viewer, const ViewMessage& message) {
  error_code problem;
  viewer->socket.text(message.is_text);
  viewer->since_write_began.emplace();
  co_await viewer->socket.async_write(asio::buffer(*message.bytes), Telling(&problem));
  viewer->since_write_began.reset();
  co_return !problem;
}

Viewers::Task<bool> Viewers::Ask(Viewer* viewer) {
  error_code problem;
  // Not to be answered by who has not read it.
  viewer->question = fmt::format("{:08x}", random_());
  const websocket::ping_data question(viewer->question.data(), viewer->question.size());
  viewer->since_write_began.emplace();
  co_await viewer->socket.async_ping(question, Telling(&problem));
  viewer->since_write_began.reset();
  co_return !problem;
}

void Viewers::TakeAnswer(beast::string_view answer, Viewer* viewer) const {
  if (viewer->question.empty() || answer != viewer->question) return;
  viewer->question.clear();
  viewer->since_shown.Restart();
  viewer->has_shown_once = true;
}

void Viewers::CountMessage(Viewer* viewer) const {
  if (viewer->since_counted.Seconds() > 1) {
    viewer->since_counted.Restart();
    viewer->messages = 0;
  }
  if (++viewer->messages > options_.most_messages_per_s) Close(viewer);
}

void Viewers::Close(Viewer* viewer) const {
  viewer->is_over = true;
  beast::get_lowest_layer(viewer->socket).close();
}

}  // namespace deepuav
