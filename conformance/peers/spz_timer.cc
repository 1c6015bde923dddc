// Encodes and decodes frames with SPZ's own library, in memory, whenever it is told to: FRAME.ply... as arguments, then on
// standard input `encode` or `decode`, one a line. Each is answered by a line of JSON with the seconds it took.
#include <chrono>
#include <cstdint>
#include <ctime>
#include <iomanip>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "load-spz.h"

namespace {

using Bytes = std::vector<uint8_t>;

// The axes of PLY, in and out.
constexpr auto AXES = spz::CoordinateSystem::RDF;

// Processor seconds of all threads.
double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double wallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<Bytes> encode(const std::vector<spz::GaussianCloud>& clouds) {
  std::vector<Bytes> packed(clouds.size());
  spz::PackOptions options;
  options.version = 4;
  options.from = AXES;
  for (size_t i = 0; i < clouds.size(); ++i) {
    if (!spz::saveSpz(clouds[i], options, &packed[i])) throw std::runtime_error("a frame cannot be encoded");
  }
  return packed;
}

// Gaussians of all frames.
size_t decode(const std::vector<Bytes>& packed) {
  size_t gaussians = 0;
  spz::UnpackOptions options;
  options.to = AXES;
  for (const Bytes& bytes : packed) gaussians += spz::loadSpz(bytes, options).numPoints;
  return gaussians;
}

size_t totalSize(const std::vector<Bytes>& packed) {
  size_t size = 0;
  for (const Bytes& bytes : packed) size += bytes.size();
  return size;
}

}  // namespace

int main(int count, char** words) {
  std::vector<spz::GaussianCloud> clouds;
  for (int i = 1; i < count; ++i) clouds.push_back(spz::loadSplatFromPly(words[i], {AXES}));
  std::vector<Bytes> packed;
  std::cout << std::fixed << std::setprecision(6);
  for (std::string request; std::getline(std::cin, request);) {
    const double processor = processorSeconds();
    const double wall = wallSeconds();
    size_t result = 0;
    if (request == "encode") {
      packed = encode(clouds);
      result = totalSize(packed);
    } else {
      result = decode(packed);
    }
    const double took = processorSeconds() - processor;
    const double tookWall = wallSeconds() - wall;
    std::cout << "{\"" << (request == "encode" ? "bytes" : "gaussians") << "\": " << result << ", \"cpu_s\": " << took
              << ", \"wall_s\": " << tookWall << "}" << std::endl;
  }
}
