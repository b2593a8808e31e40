#include "deepuav/io/model_registry.h"

#include <gmock/gmock.h>

#include "deepuav/base/sha256.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::string Entry(const std::string& name, const std::string& kind, const std::string& size,
                  const std::string& precision, const std::string& file,
                  const std::string& content) {
  std::string text = name + ":\n  kind: " + kind + "\n";
  if (!size.empty()) text += "  size: " + size + "\n";
  if (!precision.empty()) text += "  precision: " + precision + "\n";
  return text + "  file: " + file + "\n  sha256: " + Sha256(content) +
         "\n  licence: Apache-2.0\n  card: " + name + ".md\n";
}

const std::string kSmall = Entry("a_small", "superpoint", "small", "fp32", "s.onnx", "small");
const std::string kSmallInt8 =
    Entry("b_small_int8", "superpoint", "small", "int8", "i.xml", "graphweights");
const std::string kLarge = Entry("c_large", "superpoint", "large", "fp32", "l.onnx", "large");
const std::string kGlue = Entry("d_glue", "superglue", "", "fp32", "g.onnx", "glue");
const std::string kWords = Entry("e_words", "vocabulary", "", "", "w.bin", "words");

class ModelRegistryTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_.Write("s.onnx", "small");
    folder_.Write("i.xml", "graph");
    folder_.Write("i.bin", "weights");
    folder_.Write("l.onnx", "large");
    folder_.Write("g.onnx", "glue");
    folder_.Write("w.bin", "words");
  }

  ModelRegistry Read(const std::string& yaml) {
    folder_.Write("models.yaml", yaml);
    return ModelRegistry(folder_.path());
  }
  std::string Message(const std::string& yaml) {
    return ErrorOf([&] { Read(yaml); });
  }
  fs::path File(const std::string& name) const { return folder_.path() / name; }

  TemporaryFolder folder_;
};

TEST_F(ModelRegistryTest, ReadsEveryField) {
  const ModelRegistry registry = Read(kSmall + kGlue + kWords);
  ASSERT_EQ(registry.models().size(), 3u);
  const ShippedModel& model = registry.models()[0];
  EXPECT_EQ(model.name, "a_small");
  EXPECT_EQ(model.kind, "superpoint");
  EXPECT_EQ(model.size, "small");
  EXPECT_EQ(model.precision, "fp32");
  EXPECT_EQ(model.file, File("s.onnx"));
  EXPECT_EQ(model.sha256, Sha256(std::string("small")));
  EXPECT_EQ(model.licence, "Apache-2.0");
  EXPECT_EQ(model.card, File("a_small.md"));
  EXPECT_EQ(registry.Vocabulary()->name, "e_words");
  EXPECT_TRUE(registry.HasKind("superglue"));
  EXPECT_FALSE(Read(kSmall).HasKind("superglue"));
  EXPECT_EQ(Read(kSmall).Vocabulary(), nullptr);
}

TEST_F(ModelRegistryTest, FaultsAreNamed) {
  EXPECT_THAT(ErrorOf([&] { ModelRegistry(folder_.path() / "none"); }), HasSubstr("models.yaml"));
  EXPECT_THAT(Message(Replaced(kSmall, "superpoint", "superpiont")),
              HasSubstr("models.yaml:2: a_small.kind is 'superpiont': expected one of superpoint"));
  EXPECT_THAT(Message(Replaced(kSmall, "fp32", "fp16")), HasSubstr("a_small.precision is 'fp16'"));
  EXPECT_THAT(Message(Replaced(kSmall, "  size: small\n", "")), HasSubstr("a_small.size"));
  EXPECT_THAT(Message(Replaced(kSmall, "licence", "license")),
              HasSubstr("the nearest known one is 'a_small.licence'"));
  EXPECT_THAT(Message(Replaced(kSmall, "s.onnx", "../s.onnx")), HasSubstr("a_small.file"));
  EXPECT_THAT(Message(Replaced(kSmall, "sha256: ", "sha256: 0")), HasSubstr("64"));
  EXPECT_THAT(Message(Entry("x", "vocabulary", "", "fp32", "w.bin", "words")),
              HasSubstr("x.precision: a vocabulary has none"));
  EXPECT_THAT(Message(Entry("x", "superglue", "small", "fp32", "g.onnx", "glue")),
              HasSubstr("x.size: a superglue has none"));
  EXPECT_THAT(Message(kSmall + Entry("twin", "superpoint", "small", "fp32", "l.onnx", "large")),
              HasSubstr("'twin' has the kind, size and precision of 'a_small'"));
}

TEST_F(ModelRegistryTest, ChoosesBySizeAndPrecision) {
  const ModelRegistry registry = Read(kSmall + kSmallInt8 + kLarge + kGlue);
  const auto chosen = [&](const char* size, const char* precision, bool int8_is_fast) {
    return registry.Network("superpoint", size, precision, int8_is_fast).name;
  };
  EXPECT_EQ(chosen("small", "auto", false), "a_small");
  EXPECT_EQ(chosen("small", "auto", true), "b_small_int8");
  EXPECT_EQ(chosen("small", "int8", false), "b_small_int8");
  for (const bool int8_is_fast : {false, true}) {
    EXPECT_EQ(chosen("small", "fp32", int8_is_fast), "a_small");
    EXPECT_EQ(chosen("small", "bf16", int8_is_fast), "a_small");
    EXPECT_EQ(chosen("large", "auto", int8_is_fast), "c_large");
    EXPECT_EQ(registry.Network("superglue", "", "auto", int8_is_fast).name, "d_glue");
  }
  EXPECT_EQ(Read(kSmallInt8).Network("superpoint", "small", "auto", false).name, "b_small_int8");
}

TEST_F(ModelRegistryTest, SaysWhichThereAre) {
  const ModelRegistry registry = Read(kSmall + kSmallInt8 + kLarge);
  EXPECT_EQ(ErrorOf([&] { registry.Network("superpoint", "huge", "auto", true); }),
            "no superpoint of size 'huge' is shipped: there are small (fp32), small (int8), large "
            "(fp32)");
  EXPECT_EQ(ErrorOf([&] { registry.Network("superpoint", "large", "int8", true); }),
            "no superpoint of size 'large' is shipped for the precision int8: there are small "
            "(fp32), small (int8), large (fp32)");
  EXPECT_EQ(ErrorOf([&] { registry.Network("superglue", "", "auto", true); }),
            "no superglue is shipped: there are none");
  EXPECT_THAT(ErrorOf([&] { Read(kSmallInt8).Network("superpoint", "small", "fp32", true); }),
              HasSubstr("for the precision fp32: there are small (int8)"));
}

TEST_F(ModelRegistryTest, ChecksShippedFiles) {
  const ModelRegistry registry = Read(kSmall + kSmallInt8 + kWords);
  EXPECT_EQ(registry.Check(File("s.onnx")).name, "a_small");
  EXPECT_EQ(registry.Check(File("i.xml")).sha256, Sha256(std::string("graphweights")));
  for (const ShippedModel& model : registry.models())
    EXPECT_EQ(ModelRegistry::StateOf(model), ModelState::kOk);

  folder_.Write("s.onnx", "smell");
  const std::string message = ErrorOf([&] { registry.Check(File("s.onnx")); });
  EXPECT_THAT(message, HasSubstr(File("s.onnx").string()));
  EXPECT_THAT(message, HasSubstr(Sha256(std::string("smell"))));
  EXPECT_THAT(message, HasSubstr("expected " + Sha256(std::string("small"))));
  EXPECT_EQ(ModelRegistry::StateOf(registry.models()[0]), ModelState::kDamaged);

  fs::remove(File("i.bin"));
  EXPECT_THAT(ErrorOf([&] { registry.Check(File("i.xml")); }), HasSubstr("i.bin"));
  EXPECT_EQ(ModelRegistry::StateOf(registry.models()[1]), ModelState::kDamaged);

  fs::remove(File("w.bin"));
  EXPECT_THAT(ErrorOf([&] { registry.Check(File("w.bin")); }),
              HasSubstr("w.bin: no such file: expected the shipped model e_words"));
  EXPECT_EQ(ModelRegistry::StateOf(registry.models()[2]), ModelState::kMissing);
}

TEST_F(ModelRegistryTest, OtherFilesAreHashed) {
  const ModelRegistry registry = Read(kSmall);
  TemporaryFolder elsewhere;
  const fs::path own = elsewhere.Write("s.onnx", "my own");
  const CheckedModel checked = registry.Check(own);
  EXPECT_EQ(checked.name, "");
  EXPECT_EQ(checked.file, own);
  EXPECT_EQ(checked.sha256, Sha256(std::string("my own")));
  EXPECT_EQ(registry.Check(File("l.onnx")).name, "");
  EXPECT_EQ(ErrorOf([&] { registry.Check(elsewhere.path() / "none.onnx"); }),
            (elsewhere.path() / "none.onnx").string() + ": no such file: expected a model");
}

TEST_F(ModelRegistryTest, KnowsShippedFilesByOtherPaths) {
  const ModelRegistry registry = Read(kSmall);
  EXPECT_EQ(registry.Check(folder_.path() / "." / "s.onnx").name, "a_small");
  TemporaryFolder elsewhere;
  fs::create_symlink(File("s.onnx"), elsewhere.path() / "link.onnx");
  EXPECT_EQ(registry.Check(elsewhere.path() / "link.onnx").name, "a_small");
}

/// What is in the repository is as its registry and its cards say.
TEST(ShippedModelsTest, AreWhole) {
  const ModelRegistry registry{fs::path(DEEPUAV_MODELS)};
  EXPECT_TRUE(registry.HasKind("superpoint"));
  ASSERT_NE(registry.Vocabulary(), nullptr);
  uintmax_t bytes = 0;
  for (const ShippedModel& model : registry.models()) {
    SCOPED_TRACE(model.name);
    EXPECT_EQ(ModelRegistry::StateOf(model), ModelState::kOk);
    const std::string card = ReadAll(model.card);
    EXPECT_THAT(card, HasSubstr(model.sha256));
    EXPECT_THAT(card, HasSubstr(model.licence));
    bytes += fs::file_size(model.file);
  }
  EXPECT_LE(bytes, 16'000'000u);
}

}  // namespace
}  // namespace deepuav
