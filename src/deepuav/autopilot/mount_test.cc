#include "deepuav/autopilot/mount.h"

#include <gmock/gmock.h>

#include "deepuav/autopilot/link_address.h"
#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

const Vector3d kAhead(0, 0, 1), kRightInImage(1, 0, 0), kUpInImage(0, -1, 0);

TEST(Mount, ForwardLooksAlongTheBody) {
  const Eigen::Quaterniond body_from_cam = ParseMount("forward");
  EXPECT_TRUE((body_from_cam * kAhead).isApprox(Vector3d(1, 0, 0)));
  EXPECT_TRUE((body_from_cam * kRightInImage).isApprox(Vector3d(0, 1, 0)));
  EXPECT_TRUE((body_from_cam * kUpInImage).isApprox(Vector3d(0, 0, -1)));
}

TEST(Mount, DownHasTheUpperEdgeInFront) {
  const Eigen::Quaterniond body_from_cam = ParseMount("down");
  EXPECT_TRUE((body_from_cam * kAhead).isApprox(Vector3d(0, 0, 1)));
  EXPECT_TRUE((body_from_cam * kUpInImage).isApprox(Vector3d(1, 0, 0)));
  EXPECT_TRUE(body_from_cam.isApprox(ParseMount("0,-90,0"), 1e-12));
}

TEST(Mount, AnglesAreOfTheBody) {
  const double half = std::sqrt(0.5);
  EXPECT_TRUE((ParseMount("0,-45,0") * kAhead).isApprox(Vector3d(half, 0, half)));
  EXPECT_TRUE((ParseMount("0,0,90") * kAhead).isApprox(Vector3d(0, 1, 0)));
  EXPECT_TRUE((ParseMount("90,0,0") * kUpInImage).isApprox(Vector3d(0, 1, 0)));
  // A camera to the right of the nose that looks down by 45 degrees.
  EXPECT_TRUE((ParseMount("0,-45,90") * kAhead).isApprox(Vector3d(0, half, half)));
}

TEST(Mount, OfARosBody) {
  const SE3 ahead(ParseMount("forward"), {0.1, 0.2, 0.3});
  Eigen::Matrix3d flu_from_cam;  // Forward is the camera's z, left its -x, up its -y.
  flu_from_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const SE3 mount = MountOfRosBody(SE3(flu_from_cam, {0.1, -0.2, -0.3}));
  EXPECT_TRUE(mount.Matrix().isApprox(ahead.Matrix(), 1e-12));
}

TEST(Mount, RefusesWhatIsNone) {
  for (const char* text :
       {"", "up", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "0,400,0", "1,2,3 ", "1;2;3"}) {
    EXPECT_THROW(ParseMount(text), Error) << text;
    EXPECT_THROW(ParseMountOffset(text), Error) << text;
  }
  EXPECT_EQ(ParseMountOffset("0.1,-0.2,0"), Vector3d(0.1, -0.2, 0));
}

TEST(LinkAddress, NamesHostAndPort) {
  const LinkAddress address = ParseLinkAddress("udp:fc.local:14540");
  EXPECT_EQ(address.host, "fc.local");
  EXPECT_EQ(address.port, 14540);
  EXPECT_EQ(ParseLinkAddress("udp:[::1]:1").host, "::1");
  for (const char* text : {"", "udp:", "udp:host", "udp::14540", "tcp:host:1", "udp:host:0",
                           "udp:host:65536", "udp:host:1x", "udp:host:", "host:14540"}) {
    EXPECT_THROW(ParseLinkAddress(text), Error) << text;
  }
}

}  // namespace
}  // namespace deepuav
