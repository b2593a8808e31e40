#include "deepuav/viewer/access_rules.h"

#include <gmock/gmock.h>

#include "deepuav/base/error.h"
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
  EXPECT_TRUE(IsOurHost("127.0.0.1:8765", Local()));
  EXPECT_TRUE(IsOurHost("localhost:8765", Local()));
  for (const char* other : {"", "127.0.0.1", "127.0.0.1:80", "evil.example:8765", ":8765",
                            "127.0.0.1:8765:8765", "localhost.evil.example:8765"})
    EXPECT_FALSE(IsOurHost(other, Local())) << other;
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
