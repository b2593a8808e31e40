#include "deepuav/base/logging.h"

#include <gmock/gmock.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

TEST(Log, RefusesUnknownLevels) {
  EXPECT_THAT([] { LogToStderr("loud"); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("log level is 'loud'")));
}

TEST(Log, WritesToStderrFromItsLevelOn) {
  ::testing::internal::CaptureStderr();
  Log().error("before");
  LogToStderr("warn");
  Log().info("quiet");
  Log().warn("{} frames lost", 3);
  Log().flush();
  LogToStderr("off");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "warning: 3 frames lost\n");
}

}  // namespace
}  // namespace deepuav
