#include "deepuav/capture/stream_source.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

TEST(StreamSource, TellsAddressesFromFiles) {
  for (const char* address : {"/dev/video0", "rtsp://camera/front", "udp://@:5000", "flight.sdp"})
    EXPECT_TRUE(IsStreamAddress(address)) << address;
  for (const char* file : {"flight.mp4", "MH_01_easy", "/data/dev/video.avi"})
    EXPECT_FALSE(IsStreamAddress(file)) << file;
}

TEST(StreamSource, ShowsNoSecrets) {
  EXPECT_EQ(WithoutSecrets("rtsp://ann:pass@camera:554/front"), "rtsp://camera:554/front");
  EXPECT_EQ(WithoutSecrets("rtsp://ann:p@ss@camera"), "rtsp://camera");
  EXPECT_EQ(WithoutSecrets("http://camera/a@b?key=secret"), "http://camera/a@b?...");
  EXPECT_EQ(WithoutSecrets("udp://@:5000"), "udp://:5000");
  EXPECT_EQ(WithoutSecrets("/dev/video0"), "/dev/video0");
}

TEST(StreamSource, RefusesWhatIsNotThere) {
  StreamSource source("http://ann:secret@127.0.0.1:1/video", {.timeout_s = 1});
  try {
    source.Open();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("secret"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("127.0.0.1:1/video"), std::string::npos);
  }
  EXPECT_FALSE(source.Next([] { return true; }));
}

}  // namespace
}  // namespace deepuav
