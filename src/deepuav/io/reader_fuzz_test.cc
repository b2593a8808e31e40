#include <cmath>

#include "deepuav/image/image.h"
#include "deepuav/io/cameras/exif.h"
#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/cameras/xmp.h"
#include "deepuav/io/cameras/xmp_lens.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/datasets/kitti_calibration.h"
#include "deepuav/io/files/options_file.h"
#include "deepuav/io/geodata/geotag_file.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/geodata/gpmf_file.h"
#include "deepuav/io/geodata/sensor_files.h"
#include "deepuav/io/geodata/srt_file.h"
#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/io/testing/camera_checks.h"
#include "deepuav/io/testing/gpmf_test_support.h"
#include "deepuav/io/testing/io_test_support.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

void CheckTrajectory(const Trajectory& trajectory) {
  EXPECT_FALSE(trajectory.empty());
  for (size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_TRUE(trajectory[i].world_from_cam.Matrix().allFinite());
    EXPECT_TRUE(i == 0 || trajectory[i - 1].time < trajectory[i].time);
  }
}

class ReaderFuzzTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(ReaderFuzzTest, EurocFrameList) {
  folder_.Write("mav0/cam0/sensor.yaml", kTestSensorYaml);
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) {
    folder_.Write("mav0/cam0/data/" + std::string(name), EncodedImage(64, 48, 1));
  }
  Fuzz({"#timestamp [ns],filename\r\n1403636579763555584,a.jpg\r\n1403636579813555456,b.jpg\r\n"
        "1403636579863555584,c.jpg\r\n"},
       4000, [&](const std::string& input) {
         folder_.Write("mav0/cam0/data.csv", input);
         const auto dataset = OpenDataset(folder_.path());
         EXPECT_GT(dataset->size(), 0);
       });
}

TEST_F(ReaderFuzzTest, TumFrameList) {
  folder_.Write("camera.yaml", kTestCameraYaml);
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) {
    folder_.Write("rgb/" + std::string(name), EncodedImage(64, 48, 1));
  }
  Fuzz({"# timestamp filename\n1305031102.175304 rgb/a.jpg\n1305031102.211214 rgb/b.jpg\n1.4e9 "
        "rgb/c.jpg\n"},
       4000, [&](const std::string& input) {
         folder_.Write("rgb.txt", input);
         const auto dataset = OpenDataset(folder_.path());
         EXPECT_GT(dataset->size(), 0);
       });
}

TEST_F(ReaderFuzzTest, KittiTimes) {
  folder_.Write("calib.txt", "P0: 45.5 0 31.25 0 0 46.5 24.75 0 0 0 1 0\n");
  folder_.Write("image_0/000000.jpg", EncodedImage(64, 48, 1));
  folder_.Write("image_0/000001.jpg", EncodedImage(64, 48, 1));
  Fuzz({"0.000000e+00\n1.036224e-01\n2.072e-01\n3.1e-1\n"}, 4000, [&](const std::string& input) {
    folder_.Write("times.txt", input);
    const auto dataset = OpenDataset(folder_.path());
    EXPECT_GE(dataset->size(), 2);
  });
}

TEST_F(ReaderFuzzTest, KittiCalibration) {
  const std::string first =
      "P0: 7.188560e+02 0 6.071928e+02 0 0 7.188560e+02 1.852157e+02 0 0 0 1 0\n";
  Fuzz({first, first + "P1: 1 2 3\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n"}, 5000,
       [&](const std::string& input) {
         const Pinhole pinhole = ReadKittiCalibration(folder_.Write("calib.txt", input));
         EXPECT_TRUE(std::isfinite(pinhole.fx) && std::isfinite(pinhole.cy));
       });
}

TEST_F(ReaderFuzzTest, Trajectories) {
  const Strings seeds = {
      "# tum\n1403636584.763555584 1 2 3 0 0 1 0\n1.4036365848e+09 -1.5 2e-3 +3 0 0 0 "
      "1\n1403636585 0 0 0 0.6 0 0 0.8\n",
      "#euroc\n1403636580838555648,4.6,-1.7,0.7,0,0,0,1,-0.02,0.03,0.8,-0.003,0.02\n"
      "1403636580843555328, 4.6,-1.7,0.7,1,0,0,0,-0.02,0.03,0.8,-0.003,0.02\n",
      "1 0 0 1.5 0 1 0 2.5 0 0 1 3.5\n0 -1 0 4 1 0 0 5 0 0 1 6\n"};
  Fuzz(seeds, 8000, [&](const std::string& input) {
    CheckTrajectory(ReadTrajectory(folder_.Write("trajectory.txt", input)));
  });
}

TEST_F(ReaderFuzzTest, TrajectoryTimes) {
  const fs::path poses =
      folder_.Write("poses.txt", "1 0 0 1 0 1 0 2 0 0 1 3\n0 -1 0 4 1 0 0 5 0 0 1 6\n");
  Fuzz({"0\n1.5e-1\n", "1403636584.763555584\n1403636584.8\n"}, 4000,
       [&](const std::string& input) {
         CheckTrajectory(ReadTrajectory(poses, folder_.Write("times.txt", input)));
       });
}

void CheckFixes(const std::vector<GnssFix>& fixes) {
  for (size_t i = 0; i < fixes.size(); ++i) {
    ASSERT_TRUE(std::abs(fixes[i].latitude_deg) <= 90 && std::abs(fixes[i].longitude_deg) <= 360);
    ASSERT_TRUE(std::abs(fixes[i].altitude_m.value_or(0)) < 1e7 && fixes[i].sigma_m.allFinite());
    if (i > 0) {
      ASSERT_LT(fixes[i - 1].time, fixes[i].time);
    }
  }
}

/// Of files that are refused where they hold none.
void CheckSomeFixes(const std::vector<GnssFix>& fixes) {
  EXPECT_FALSE(fixes.empty());
  CheckFixes(fixes);
}

TEST_F(ReaderFuzzTest, GnssTable) {
  Fuzz({"time,latitude [deg],longitude [deg],altitude [km]\n1,47.5,8.25,0.44\n2,47.5,8.2501,0.44\n",
        "\"time\";\"lat\";\"lon\"\n\"1403636584763555584\";47;8\n", "1,47,8,400\n2,47,8,401\n",
        "timestamp,lat,lon\n2024-05-01T10:00:00.5Z,47,8\n"},
       5000, [&](const std::string& input) {
         CheckSomeFixes(ReadGnssFile(folder_.Write("fixes.csv", input)));
       });
}

TEST_F(ReaderFuzzTest, GpxFile) {
  Fuzz({"<?xml version=\"1.0\"?><gpx><trk><trkseg><trkpt lat=\"47.5\" lon=\"8.25\"><ele>440</ele>"
        "<time>2024-05-01T10:00:00Z</time></trkpt><trkpt lat=\"47.6\" lon=\"8.25\"><time>"
        "2024-05-01T10:01:00Z</time></trkpt></trkseg></trk></gpx>"},
       5000, [&](const std::string& input) {
         CheckSomeFixes(ReadGnssFile(folder_.Write("fixes.gpx", input)));
       });
}

struct FuzzedOptions {
  int keypoints = 800;
  double parallax_deg = 1.5;
  bool refine = true;
  std::string features = "superpoint";

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("keypoints", keypoints, "", "", Between(0, 1e4));
    visit("parallax_deg", parallax_deg, "deg", "", Between(0, 90));
    visit("refine", refine, "", "");
    visit("features", features, "", "");
  }
};

TEST_F(ReaderFuzzTest, OptionsFile) {
  FuzzedOptions tracking, mapping;
  OptionRegistry registry;
  registry.Add("tracking", &tracking);
  registry.Add("mapping.local", &mapping);
  Fuzz({OptionsAsYaml(registry), "tracking.keypoints: 5\nmapping: {local: {refine: no}}\n"}, 5000,
       [&](const std::string& input) {
         LoadOptionsFile(folder_.Write("options.yaml", input), &registry);
       });
}

TEST_F(ReaderFuzzTest, Subtitles) {
  const Strings seeds = {
      "1\n00:00:00,000 --> 00:00:00,033\n<font size=\"28\">[latitude: 47.39] [longtitude : "
      "8.54] [rel_alt: 1.3 abs_alt: 345.1] </font>\n\n2\n00:00:01,000 --> 00:00:01,033\n"
      "[latitude: 47.40] [longitude: 8.55] [altitude: 5]\n\n",
      "1\r\n00:00:00,000 --> 00:00:01,000\r\nHOME(8.5,47.3)\r\nGPS(8.5456,47.3977,16) "
      "BAROMETER:1.5\r\n\r\n2\r\n00:00:01,000 --> 00:00:02,000\r\nGPS (8.5, 47.4, 17), D "
      "24.26m, H 6.00m, H.S 0.00m/s\r\n"};
  Fuzz(seeds, 8000, [&](const std::string& input) {
    CheckFixes(ReadSrtFile(folder_.Write("video.srt", input)));
  });
}

TEST_F(ReaderFuzzTest, GpmfTracks) {
  const std::string payload = GpmfPayload(47.5, 8.25, 500, 4);
  // What is damaged is left out, not refused.
  constexpr double kNoneRefused = 0;
  Fuzz(
      {Mp4WithTrack("gpmd", {payload, payload})}, 8000,
      [&](const std::string& input) {
        CheckFixes(ReadGpmfFixes(folder_.Write("video.mp4", input)));
      },
      kNoneRefused);
}

TEST_F(ReaderFuzzTest, ImuFile) {
  Fuzz({"#t\n1000,0.1,0.2,0.3,0.4,0.5,9.8\n2000,0.1,0.2,0.3,0.4,0.5,9.8\n"}, 4000,
       [&](const std::string& input) {
         for (const ImuSample& sample : ReadImuFile(folder_.Write("imu.csv", input)))
           ASSERT_TRUE(sample.angular_velocity.allFinite() && sample.specific_force.allFinite());
       });
}

TEST_F(ReaderFuzzTest, BarometerFile) {
  Fuzz({"#t\n1000,95000,500\n2000,95010,499\n"}, 4000, [&](const std::string& input) {
    for (const BarometerSample& sample : ReadBarometerFile(folder_.Write("baro.csv", input)))
      ASSERT_TRUE(std::isfinite(sample.pressure_pa + sample.altitude_m));
  });
}

TEST_F(ReaderFuzzTest, GnssFile) {
  Fuzz({"#t [ns],latitude [deg],longitude [deg],altitude [m],std_east [m],std_north [m],std_up "
        "[m]\n1000,47,8,500,1,1,2\n2000,47,8,501,1,1,2\n"},
       4000, [&](const std::string& input) {
         CheckSomeFixes(ReadGnssFile(folder_.Write("gps.csv", input)));
       });
}

TEST_F(ReaderFuzzTest, Geotags) {
  Fuzz({"image,latitude,longitude,altitude,std east,std north,std up\na.jpg,47,8,500,1,1,2\n",
        "a.jpg,47,8,500\nb.jpg,47,8,501\n",
        "EPSG:32632\na.jpg 500000 5200000 500 1 2 3 .1 .1\nb.jpg 500010 5200000 500\n"},
       4000, [&](const std::string& input) {
         std::vector<GnssFix> fixes;
         for (const Geotag& tag : ReadGeotagFile(folder_.Write("geo.txt", input))) {
           fixes.push_back(tag.fix);
           fixes.back().time.nanoseconds = std::ssize(fixes);
         }
         CheckSomeFixes(fixes);
       });
}

TestExif FullExif() {
  return {.model = "FC300S",
          .time = "2018:04:29 12:06:46",
          .subsecond = "25",
          .focal_length_mm = 3.61,
          .focal_length_35mm = 20,
          .focal_plane_x_px_per_inch = 10000,
          .pixel_x_dimension = 4000,
          .latitude_deg = 28.04,
          .longitude_deg = -82.7,
          .altitude_m = -5.7};
}

TEST_F(ReaderFuzzTest, Exif) {
  const Strings seeds = {JpegPhotograph(16, 16, 1, FullExif()),
                         PngPhotograph(16, 16, 1, FullExif()), ExifBlockBytes(FullExif())};
  for (const std::string& seed : seeds) {
    ASSERT_TRUE(ParseExif({reinterpret_cast<const uint8_t*>(seed.data()), seed.size()}).fix);
  }
  // Damaged EXIF is no error: it is as if it were not there.
  int64_t without_fix = 0;
  Mutator mutator(&seeds);
  const FuzzCounts counts = FuzzInputs(20000, [&](int64_t) {
    const std::string input = mutator.Next();
    const PhotoExif exif =
        ParseExif({reinterpret_cast<const uint8_t*>(input.data()), input.size()});
    if (exif.fix) {
      ASSERT_LE(std::abs(exif.fix->latitude_deg), 90);
      ASSERT_LE(std::abs(exif.fix->longitude_deg), 180);
    } else {
      ++without_fix;
    }
    const double focal_px = FocalLengthPx(exif, 800, 600).value_or(1);
    ASSERT_TRUE(std::isfinite(focal_px) && focal_px > 0);
  });
  EXPECT_EQ(counts.refused, 0);
  EXPECT_GT(without_fix, counts.inputs / 20);
}

TEST_F(ReaderFuzzTest, Xmp) {
  const Strings seeds = {
      "<drone-dji:RtkFlag>50</drone-dji:RtkFlag> drone-dji:GpsLatitude=\"+47.4012345\" "
      "drone-dji:GpsLongitude=\"-8.5498\" drone-dji:AbsoluteAltitude=\"+512.3\" "
      "drone-dji:RtkStdLon=\"0.011\" drone-dji:RtkStdLat=\"0.012\" drone-dji:RtkStdHgt=\"0.026\" "
      "Camera:GPSXYAccuracy=\"0.03\" Camera:GPSZAccuracy=\"0.05\" "
      "drone-dji:GimbalYawDegree=\"+91.2\" drone-dji:GimbalPitchDegree=\"-89.9\" "
      "drone-dji:GimbalRollDegree=\"0.1\" "
      "drone-dji:DewarpData=\"2019-03-13;3660,3653,-7,44,-0.27,0.11,-0.0001,0.0003,-0.035\"",
      "<Camera:ModelType>perspective</Camera:ModelType><Camera:PrincipalPoint>2.4,1.8"
      "</Camera:PrincipalPoint><Camera:PerspectiveFocalLength>5.4</Camera:PerspectiveFocalLength>"
      "<Camera:PerspectiveFocalLengthUnits>mm</Camera:PerspectiveFocalLengthUnits>"
      "<Camera:PerspectiveDistortion>-0.1,0.15,-0.05,0.0002,0.0007</Camera:PerspectiveDistortion>"
      "<Camera:BandName><rdf:Seq><rdf:li>NIR</rdf:li></rdf:Seq></Camera:BandName>"};
  ASSERT_TRUE(ParseXmpRtkFix(seeds[0]) && ParseXmpAttitude(seeds[0]));
  PhotoExif exif;
  exif.sensor_width_mm = 4.8;
  const auto camera_of = [&](const std::string& xmp) {
    return CameraFromMetadata(ParseXmpLens(xmp), exif, {4864, 3648});
  };
  ASSERT_TRUE(camera_of(seeds[0]) && camera_of(seeds[1]) && ParseXmpBand(seeds[1]) == "NIR");
  int64_t without_fix = 0;
  Mutator mutator(&seeds);
  const FuzzCounts counts = FuzzInputs(20000, [&](int64_t) {
    const std::string input = mutator.Next();
    const auto fix = ParseXmpRtkFix(input);
    without_fix += !fix;
    if (fix) {
      ASSERT_TRUE(IsPlaceOnEarth(*fix));
      ASSERT_TRUE(std::isfinite(fix->altitude_m.value_or(0)));
      ASSERT_TRUE(fix->sigma_m.allFinite() && fix->sigma_m.minCoeff() >= 0);
    }
    ASSERT_TRUE(ParseXmpAccuracy_m(input).allFinite());
    ParseXmpBand(input);
    if (const auto camera = camera_of(input)) CheckCamera(camera->camera);
    const auto attitude = ParseXmpAttitude(input);
    if (attitude) {
      ASSERT_NEAR(attitude->norm(), 1, 1e-9);
    }
  });
  EXPECT_EQ(counts.refused, 0);
  EXPECT_GT(without_fix, counts.inputs / 20);
}

TEST_F(ReaderFuzzTest, PhotographFolder) {
  Fuzz({JpegPhotograph(64, 48, 1, FullExif()), PngPhotograph(64, 48, 1, FullExif())}, 1500,
       [&](const std::string& input) {
         folder_.Write("a.jpg", input);
         const auto dataset = OpenDataset(folder_.path());
         CheckCamera(dataset->camera());
         EXPECT_EQ(dataset->Load(0).cols, dataset->camera().width);
       });
}

TEST_F(ReaderFuzzTest, ImageDecoder) {
  const Strings seeds = {EncodedImage(64, 48, 1), EncodedImage(64, 48, 1, ".png"),
                         EncodedImage(64, 48, 1, ".tif"), JpegPhotograph(40, 24, 2, FullExif())};
  Fuzz(seeds, 10000, [](const std::string& input) {
    const GreyImage image = DecodeGrey({input.begin(), input.end()}, "image");
    EXPECT_FALSE(image.empty());
  });
}

}  // namespace
}  // namespace deepuav
