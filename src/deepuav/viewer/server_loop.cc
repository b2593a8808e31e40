#include "deepuav/viewer/server_loop.h"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/viewer/asio_terms.h"
#include "deepuav/viewer/own_addresses.h"

namespace deepuav {
namespace {

constexpr int kMostRequests = 100;  // Of a connection.
constexpr double kTickInterval = 0.025, kAcceptPause = 0.1;
constexpr int kSendBufferBytes = 128 * 1024;  // What waits there is old when it arrives.

std::string_view View(beast::string_view text) { return {text.data(), text.size()}; }

PageRequest RequestOf(const ServerLoop::Parser::value_type& request) {
  return {request.method() == http::verb::get, View(request.target()),
          View(request[http::field::host]), View(request[http::field::origin]),
          View(request[http::field::cookie])};
}

using Response = http::response<http::span_body<const char>>;

/// The page may show and ask for nothing but its own files, and stand in no one else's.
void AddSafety(std::string_view host, Response* response) {
  response->set("Content-Security-Policy",
                fmt::format("default-src 'none'; script-src 'self'; style-src 'self' "
                            "'unsafe-inline'; img-src 'self' blob: data:; connect-src 'self' "
                            "ws://{}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                            host));
  response->set("X-Content-Type-Options", "nosniff");
  response->set("X-Frame-Options", "DENY");
  response->set("Referrer-Policy", "no-referrer");
  response->set("Cross-Origin-Resource-Policy", "same-origin");
  response->set(http::field::cache_control, "no-store");
}

Response ResponseOf(const PageAnswer& answer, std::string_view host, bool keep_alive) {
  Response response;
  response.version(11);
  response.result(static_cast<unsigned>(answer.status));
  response.set(http::field::content_type,
               beast::string_view(answer.type.data(), answer.type.size()));
  // A refused name is not repeated.
  AddSafety(answer.status == 200 ? host : "localhost", &response);
  if (!answer.cookie.empty()) response.set(http::field::set_cookie, answer.cookie);
  if (!answer.location.empty()) response.set(http::field::location, answer.location);
  response.body() = beast::span<const char>(answer.body.data(), answer.body.size());
  response.keep_alive(keep_alive);
  response.prepare_payload();
  return response;
}

}  // namespace

ServerLoop::ServerLoop(ViewModel* model, const ViewServerOptions& options)
    : model_(model), options_(options) {
  options_.Check();
  const bool is_open_to_others = !IsLoopback(options_.listen);
  const tcp::endpoint endpoint(asio::ip::make_address(options_.listen),
                               static_cast<uint16_t>(options_.port));
  error_code problem;
  acceptor_.open(endpoint.protocol(), problem);
  if (!problem) acceptor_.set_option(asio::socket_base::reuse_address(true), problem);
  if (!problem) acceptor_.bind(endpoint, problem);
  if (!problem) acceptor_.listen(asio::socket_base::max_listen_connections, problem);
  if (problem)
    throw Error("{}:{}: no page can be served there: {}", options_.listen, options_.port,
                problem.message());
  rules_.port = acceptor_.local_endpoint().port();
  rules_.hosts = OwnHosts(options_.listen);
  rules_.any_address = endpoint.address().is_unspecified();
  if (is_open_to_others) rules_.token = NewToken();
}

std::string ServerLoop::Url() const {
  std::string url = fmt::format("http://{}:{}/", rules_.hosts.front(), rules_.port);
  if (!rules_.token.empty()) url += "?token=" + rules_.token;
  return url;
}

void ServerLoop::Run() {
  asio::co_spawn(context_, Accept(), asio::detached);
  asio::co_spawn(context_, Tick(), asio::detached);
  while (!context_.stopped()) {
    try {
      context_.run();
    } catch (const std::exception& error) {
      Log().debug("view: {}", error.what());
    }
  }
}

void ServerLoop::Stop() {
  asio::post(context_, [this] { since_stop_.emplace(); });
}

void ServerLoop::GoOnEnding() {
  all_is_told_ = true;
  viewers_.End();
  if (viewers_.empty() || since_stop_->Seconds() >= options_.farewell_s) context_.stop();
}

ServerLoop::Task<> ServerLoop::Accept() {
  asio::steady_timer pause(context_);
  while (true) {
    error_code problem;
    tcp::socket socket = co_await acceptor_.async_accept(Telling(&problem));
    if (problem) {  // As without descriptors.
      pause.expires_after(InSeconds(kAcceptPause));
      co_await pause.async_wait(Telling(&problem));
      continue;
    }
    const asio::ip::address client = socket.remote_endpoint(problem).address();
    if (problem || !rate_.Count(client)) continue;
    MakeRoom();
    socket.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), problem);
    socket.set_option(tcp::no_delay(true), problem);
    auto stream = std::make_shared<Stream>(std::move(socket));
    connections_.push_back(stream);
    asio::co_spawn(context_, Serve(std::move(stream), client), asio::detached);
  }
}

void ServerLoop::MakeRoom() {
  if (connections_.size() < static_cast<size_t>(options_.most_connections)) return;
  connections_.front()->close();
  connections_.pop_front();
}

ServerLoop::Task<> ServerLoop::Tick() {
  asio::steady_timer timer(context_);
  while (true) {
    timer.expires_after(InSeconds(kTickInterval));
    error_code problem;
    co_await timer.async_wait(Telling(&problem));
    try {
      if (!all_is_told_) model_->Refresh(since_stop_.has_value());
    } catch (const std::exception& error) {
      Log().debug("view: {}", error.what());
    }
    viewers_.ShutOutBlocked();
    if (since_stop_) GoOnEnding();
  }
}

ServerLoop::Task<> ServerLoop::Serve(std::shared_ptr<Stream> stream, asio::ip::address client) {
  beast::flat_buffer buffer(static_cast<size_t>(2 * options_.most_header_bytes));
  bool goes_on = true;
  for (int request = 0; goes_on && request < kMostRequests; ++request) {
    Parser parser;
    parser.header_limit(static_cast<uint32_t>(options_.most_header_bytes));
    parser.body_limit(0);
    stream->expires_after(InSeconds(options_.request_timeout_s));
    error_code problem;
    co_await http::async_read(*stream, buffer, parser, Telling(&problem));
    if (problem) {
      co_await Refuse(stream.get(), problem);
      break;
    }
    if (!rate_.Count(client)) {
      const PageAnswer refusal = Refusal(429, "Too many requests within a second.\n");
      co_await Respond(stream.get(), refusal, "", false);
      break;
    }
    PageAnswer refusal;
    if (websocket::is_upgrade(parser.get()) && MayWatch(parser.get(), &refusal)) {
      connections_.remove(stream);
      co_await viewers_.Watch(std::move(*stream), parser.release());
      co_return;
    }
    goes_on = co_await Answer(stream.get(), parser);
  }
  connections_.remove(stream);
  stream->close();
}

ServerLoop::Task<bool> ServerLoop::Answer(Stream* stream, const Parser& parser) {
  const auto& request = parser.get();
  const PageRequest asked = RequestOf(request);
  PageAnswer answer;
  const bool is_upgrade = websocket::is_upgrade(request);
  if (!is_upgrade || MayWatch(request, &answer)) answer = AnswerPage(asked, rules_);
  const bool keep_alive = request.keep_alive() && !is_upgrade && answer.status < 400;
  co_return co_await Respond(stream, answer, asked.host, keep_alive);
}

ServerLoop::Task<bool> ServerLoop::Respond(Stream* stream, const PageAnswer& answer,
                                           std::string_view host, bool goes_on) {
  Response response = ResponseOf(answer, host, goes_on);
  stream->expires_after(InSeconds(options_.write_timeout_s));
  error_code problem;
  co_await http::async_write(*stream, response, Telling(&problem));
  co_return goes_on && !problem;
}

ServerLoop::Task<> ServerLoop::Refuse(Stream* stream, error_code problem) {
  const bool is_parsed = problem == http::error::header_limit ||
                         problem == http::error::buffer_overflow ||
                         problem == http::error::body_limit;
  if (!is_parsed) co_return;
  const PageAnswer answer = Refusal(431, "The request is too large.\n");
  co_await Respond(stream, answer, "", false);
}

bool ServerLoop::MayWatch(const Parser::value_type& request, PageAnswer* refusal) const {
  const PageRequest asked = RequestOf(request);
  if (!MaySee(asked, rules_, refusal)) return false;
  refusal->status = 403;
  refusal->body = "Only its own page may ask.\n";
  if (asked.origin.empty()) return false;  // A browser says where the page is from.
  refusal->status = 404;
  if (SplitTarget(asked.target).path != kMessagesPath) return false;
  refusal->status = 503;
  refusal->body = "Too many look already.\n";
  return viewers_.HaveRoom();
}

}  // namespace deepuav
