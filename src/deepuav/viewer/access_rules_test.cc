#include "deepuav/viewer/access_rules.h"

#include <gmock/gmock.h>

#include "deepuav/base/error.h"
#include "deepuav/viewer/own_addresses.h"
#include "deepuav/viewer/page_answers.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdef";

AccessRules Local() { return {{"127.0.0.1", "localhost"}, 8765, ""}; }
AccessRules Open() { return {{"10.0.0.2"}, 8765, kToken}; }

PageRequest Get(std::string_view target, std::string_view host = "127.0.0.1:8765") {
  return {true, target, host, {}, {}};
}

TEST(AccessRules, KnowTheirHosts) {
  const AccessRules drone{{"10.0.0.2", "Drone", "Drone.local"}, 8765, kToken};
  for (const char* own : {"10.0.0.2:8765", "Drone:8765", "drone:8765", "DRONE.Local:8765"})
    EXPECT_TRUE(IsOurHost(own, drone)) << own;
  for (const char* other :
       {"", "10.0.0.2", "10.0.0.2:80", "10.0.0.3:8765", "evil.example:8765", ":8765",
        "drone:", "10.0.0.2:8765:8765", "drone.evil.example:8765", "drone:+8765", "drone:74301"})
    EXPECT_FALSE(IsOurHost(other, drone)) << other;
}

TEST(AccessRules, TakeNamesOfTheLoopbackAtAnyPort) {
  for (const AccessRules& rules : {Local(), Open()}) {
    for (const char* own : {"127.0.0.1:8765", "localhost:8765", "localhost:9000", "LocalHost",
                            "127.0.0.1", "[::1]:80", "[::1]"})
      EXPECT_TRUE(IsOurHost(own, rules)) << own;
    for (const char* other : {"evil.example:8765", "localhost.evil.example:8765", "localhost:x",
                              "127.0.0.1.evil.example:8765", "127.0.0.1:8765:8765", "::1:8765"})
      EXPECT_FALSE(IsOurHost(other, rules)) << other;
  }
}

TEST(AccessRules, TakeAnyAddressWhereTheyListenAtAll) {
  AccessRules rules = Open();
  EXPECT_FALSE(IsOurHost("192.168.1.7:8765", rules));
  rules.any_address = true;
  for (const char* address : {"192.168.1.7:8765", "[fd00::7]:8765", "[FD00::7]:8765"})
    EXPECT_TRUE(IsOurHost(address, rules)) << address;
  for (const char* other :
       {"192.168.1.7", "192.168.1.7:8766", "192.168.1:8765", "fd00::7:8765", "[]:8765", "[:8765",
        "[fe80::1%eth0]:8765", "[192.168.1.7]:8765", "[10.0.0.2:8765", "evil.example:8765",
        "192.168.1.7.evil.example:8765", "7.evil.example:8765"})
    EXPECT_FALSE(IsOurHost(other, rules)) << other;
}

TEST(AccessRules, NeedNoPortInAHostWhereItIsThatOfHttp) {
  const AccessRules rules{{"drone"}, 80, kToken};
  EXPECT_TRUE(IsOurHost("drone", rules));
  EXPECT_TRUE(IsOurHost("drone:80", rules));
  EXPECT_FALSE(IsOurHost("drone:8765", rules));
}

TEST(OwnHosts, BeginWithOneThatABrowserOpens) {
  EXPECT_EQ(OwnHosts("10.0.0.2").front(), "10.0.0.2");
  EXPECT_EQ(OwnHosts("fd00::2").front(), "[fd00::2]");
  EXPECT_EQ(OwnHosts("::1").front(), "[::1]");
  EXPECT_NE(OwnHosts("0.0.0.0").front(), "0.0.0.0");
  EXPECT_NE(OwnHosts("::").front(), "[::]");
}

TEST(AccessRules, KnowTheirOrigin) {
  EXPECT_TRUE(IsOurOrigin("http://localhost:8765", "localhost:8765"));
  for (const char* other : {"", "null", "https://localhost:8765", "http://localhost:8766",
                            "http://evil.example", "http://localhost:8765.evil.example"})
    EXPECT_FALSE(IsOurOrigin(other, "localhost:8765")) << other;
}

TEST(AccessRules, TakeTheTokenAlone) {
  EXPECT_TRUE(IsToken("", Local()));
  EXPECT_TRUE(IsToken(kToken, Open()));
  for (const char* wrong : {"", "0", "0123456789abcdeg", "0123456789abcdef0", "0123456789abcde"})
    EXPECT_FALSE(IsToken(wrong, Open())) << wrong;
  EXPECT_EQ(NewToken().size(), 32u);
  EXPECT_NE(NewToken(), NewToken());
}

TEST(AccessRules, ReadCookiesAndTargets) {
  EXPECT_EQ(CookieValue("a=1; view=2;b=3", "view"), "2");
  EXPECT_EQ(CookieValue("aview=1; view2=2", "view"), "");
  EXPECT_EQ(CookieValue("", "view"), "");
  EXPECT_EQ(SplitTarget("/a?x=1&token=2&y").token, "2");
  EXPECT_EQ(SplitTarget("/a?x=1&token=2&y").path, "/a");
  EXPECT_EQ(SplitTarget("/a").token, "");
  EXPECT_EQ(SplitTarget("").path, "");
}

TEST(AccessRules, KnowWhatOnlyThisMachineReaches) {
  EXPECT_TRUE(IsLoopback("127.0.0.1"));
  EXPECT_TRUE(IsLoopback("::1"));
  EXPECT_FALSE(IsLoopback("0.0.0.0"));
  EXPECT_THROW(IsLoopback("localhost"), Error);
}

TEST(PageAnswers, AreItsFilesAndNothingElse) {
  EXPECT_THAT(std::string(AnswerPage(Get("/"), Local()).body), HasSubstr("<!DOCTYPE html>"));
  EXPECT_THAT(std::string(AnswerPage(Get("/view.js?x"), Local()).body), HasSubstr("use strict"));
  for (const char* none : {"", "//", "/../etc/passwd", "/etc/passwd", "/view.html", "/%2e%2e/", "*",
                           "http://127.0.0.1/", "/view.js/", "view.js"})
    EXPECT_EQ(AnswerPage(Get(none), Local()).status, 404) << none;
  PageRequest post = Get("/");
  post.is_get = false;
  EXPECT_EQ(AnswerPage(post, Local()).status, 405);
}

TEST(PageAnswers, AreForThemThatMaySeeThem) {
  EXPECT_EQ(AnswerPage(Get("/", "evil.example:8765"), Local()).status, 421);
  PageRequest foreign = Get("/");
  foreign.origin = "http://evil.example";
  EXPECT_EQ(AnswerPage(foreign, Local()).status, 403);

  constexpr const char* kHost = "10.0.0.2:8765";
  EXPECT_EQ(AnswerPage(Get("/", kHost), Open()).status, 403);
  EXPECT_EQ(AnswerPage(Get("/?token=wrong", kHost), Open()).status, 403);
  const std::string target = std::string("/?token=") + kToken;
  const PageAnswer moved = AnswerPage(Get(target, kHost), Open());
  EXPECT_EQ(moved.status, 303);
  EXPECT_EQ(moved.location, "/");
  EXPECT_THAT(moved.cookie, HasSubstr("HttpOnly; SameSite=Strict"));
  PageRequest later = Get("/", kHost);
  const std::string cookie = CookieName(Open()) + "=" + kToken;
  later.cookies = cookie;
  EXPECT_EQ(AnswerPage(later, Open()).status, 200);
}

}  // namespace
}  // namespace deepuav
