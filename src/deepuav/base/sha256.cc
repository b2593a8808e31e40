#include "deepuav/base/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"

namespace deepuav {
namespace {

constexpr size_t kChunkBytes = 1 << 16;

class Hasher {
 public:
  Hasher() : context_(EVP_MD_CTX_new()) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1) {
      throw Error("SHA-256: the cryptographic library gives no digest");
    }
  }

  void Update(const void* bytes, size_t count) {
    if (EVP_DigestUpdate(context_.get(), bytes, count) != 1) {
      throw Error("SHA-256: the cryptographic library failed");
    }
  }

  std::string Finish() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
    unsigned int length = 0;
    if (EVP_DigestFinal_ex(context_.get(), digest.data(), &length) != 1) {
      throw Error("SHA-256: the cryptographic library failed");
    }
    std::string hex;
    for (unsigned int i = 0; i < length; ++i) hex += fmt::format("{:02x}", digest[i]);
    return hex;
  }

 private:
  struct Free {
    void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
  };
  std::unique_ptr<EVP_MD_CTX, Free> context_;
};

}  // namespace

std::string Sha256(std::span<const std::byte> bytes) {
  Hasher hasher;
  hasher.Update(bytes.data(), bytes.size());
  return hasher.Finish();
}

std::string Sha256(const std::string& text) { return Sha256(std::as_bytes(std::span(text))); }

std::string Sha256OfFiles(const std::vector<std::filesystem::path>& files) {
  Hasher hasher;
  std::vector<char> chunk(kChunkBytes);
  for (const auto& file : files) {
    RefuseNamedPipe(file);
    std::ifstream stream(file, std::ios::binary);
    while (stream) {
      stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
      hasher.Update(chunk.data(), static_cast<size_t>(stream.gcount()));
    }
    if (!stream.eof()) throw Error("{}: cannot be read", file.string());
  }
  return hasher.Finish();
}

}  // namespace deepuav
