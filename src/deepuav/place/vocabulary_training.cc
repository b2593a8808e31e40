#include "deepuav/place/vocabulary_training.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/features/dot_kernels.h"

namespace deepuav {
namespace {

constexpr int kMaxBranching = 1000;
constexpr int kMaxDepth = 10;
constexpr double kConverged = 1e-4;  // k-means ends when no centre moves further

/// One descriptor of the training images.
struct TrainingRow {
  const int8_t* values = nullptr;
  float scale = 0;
};
using TrainingRows = std::vector<TrainingRow>;

/// cv::kmeans draws from a generator that its thread shares with others.
class SeededOpenCv {
 public:
  explicit SeededOpenCv(uint64_t seed) : saved_(cv::theRNG()) { cv::theRNG() = cv::RNG(seed); }
  ~SeededOpenCv() { cv::theRNG() = saved_; }
  SeededOpenCv(const SeededOpenCv&) = delete;
  SeededOpenCv& operator=(const SeededOpenCv&) = delete;

 private:
  cv::RNG saved_;
};

int CommonDimension(std::span<const Descriptors> images) {
  if (images.empty()) throw Error("no images to train a vocabulary from");
  for (const Descriptors& image : images) {
    if (image.dimension() != images.front().dimension()) {
      throw Error("an image has descriptors of dimension {}: expected {} as the first",
                  image.dimension(), images.front().dimension());
    }
  }
  return images.front().dimension();
}

/// All descriptors but those without direction.
TrainingRows GatherRows(std::span<const Descriptors> images) {
  TrainingRows rows;
  for (const Descriptors& image : images) {
    for (int i = 0; i < image.size(); ++i) {
      const float scale = image.scales()[static_cast<size_t>(i)];
      if (scale == 0) continue;
      rows.push_back(
          {image.stored_values().data() + static_cast<ptrdiff_t>(i) * image.dimension(), scale});
    }
  }
  return rows;
}

/// Grows a tree level by level.
class TreeGrower {
 public:
  TreeGrower(int dimension, const VocabularyOptions& options)
      : options_(options), dimension_(dimension) {
    tree_.dimension = dimension;
  }

  VocabularyTree Grow(TrainingRows rows) {
    std::vector<TrainingRows> level{std::move(rows)};
    for (int depth = 0; !level.empty(); ++depth) {
      std::vector<TrainingRows> next;
      for (TrainingRows& node : level) {
        const size_t before = next.size();
        if (depth < options_.depth) Split(node, &next);
        tree_.child_counts.push_back(static_cast<uint16_t>(next.size() - before));
        TrainingRows().swap(node);
      }
      level = std::move(next);
    }
    return std::move(tree_);
  }

 private:
  /// Appends the children's rows to `children` and their centres to the tree; none where the rows
  /// are few or alike.
  void Split(const TrainingRows& rows, std::vector<TrainingRows>* children) {
    const bool is_root = tree_.child_counts.empty();
    if (!is_root && static_cast<int>(rows.size()) < options_.split_descriptors) return;
    const Descriptors centres = Cluster(rows);
    std::vector<TrainingRows> parts(static_cast<size_t>(centres.size()));
    for (const TrainingRow& row : rows) parts[NearestCentre(row, centres)].push_back(row);
    const auto used = std::count_if(parts.begin(), parts.end(),
                                    [](const TrainingRows& part) { return !part.empty(); });
    if (!is_root && used < 2) return;
    for (size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].empty()) continue;
      const auto values = centres.stored_values().subspan(i * static_cast<size_t>(dimension_),
                                                          static_cast<size_t>(dimension_));
      tree_.centres.insert(tree_.centres.end(), values.begin(), values.end());
      children->push_back(std::move(parts[i]));
    }
  }

  cv::Mat1f SampleRows(const TrainingRows& rows) const {
    const size_t count = std::min(rows.size(), static_cast<size_t>(options_.cluster_descriptors));
    cv::Mat1f samples(static_cast<int>(count), dimension_);
    for (size_t i = 0; i < count; ++i) {
      const TrainingRow& row = rows[i * rows.size() / count];
      float* sample = samples.ptr<float>(static_cast<int>(i));
      for (int k = 0; k < dimension_; ++k)
        sample[k] = row.scale * static_cast<float>(row.values[k]);
    }
    return samples;
  }

  /// The directions of the clusters' centres.
  Descriptors Cluster(const TrainingRows& rows) {
    const cv::Mat1f samples = SampleRows(rows);
    const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                                    options_.iterations, kConverged);
    constexpr int kAttempts = 1;
    cv::Mat1i labels;
    cv::Mat1f centres;
    const SeededOpenCv seeded(static_cast<uint64_t>(options_.seed) + ++clusterings_);
    cv::kmeans(samples, std::min(options_.branching, samples.rows), labels, criteria, kAttempts,
               cv::KMEANS_PP_CENTERS, centres);
    Descriptors directions(dimension_);
    for (int i = 0; i < centres.rows; ++i) {
      const cv::Mat1f centre = centres.row(i);
      const double norm = cv::norm(centre);
      if (norm == 0) continue;  // of opposite descriptors
      const cv::Mat1f direction = centre / norm;
      directions.Append({direction.ptr<float>(), static_cast<size_t>(dimension_)});
    }
    return directions;
  }

  size_t NearestCentre(const TrainingRow& row, const Descriptors& centres) const {
    size_t best = 0;
    float best_similarity = -std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < static_cast<size_t>(centres.size()); ++i) {
      const int8_t* centre = centres.stored_values().data() + i * static_cast<size_t>(dimension_);
      const float similarity =
          static_cast<float>(FastestDotKernels().dot(row.values, centre, dimension_)) *
          centres.scales()[i];
      if (similarity > best_similarity) {
        best = i;
        best_similarity = similarity;
      }
    }
    return best;
  }

  const VocabularyOptions options_;
  const int dimension_;
  uint64_t clusterings_ = 0;
  VocabularyTree tree_;
};

/// How many of the images show each word.
std::vector<int> ImagesPerWord(const Vocabulary& vocabulary, std::span<const Descriptors> images) {
  std::vector<int> counts(static_cast<size_t>(vocabulary.word_count()));
  for (const Descriptors& image : images) {
    const std::vector<int> words = vocabulary.WordIndices(image);
    for (const int word : std::set<int>(words.begin(), words.end()))
      ++counts[static_cast<size_t>(word)];
  }
  return counts;
}

}  // namespace

void VocabularyOptions::Check() const { CheckOptions("vocabulary", *this); }

void VocabularyOptions::CheckRelations() const {
  CheckOption(cluster_descriptors >= branching, "cluster_descriptors", cluster_descriptors,
              "at least vocabulary.branching");
}

Vocabulary TrainVocabulary(std::span<const Descriptors> images, const VocabularyOptions& options) {
  options.Check();
  const int dimension = CommonDimension(images);
  TrainingRows rows = GatherRows(images);
  if (rows.size() < static_cast<size_t>(options.branching)) {
    throw Error("{} descriptors to train a vocabulary from: expected at least {}", rows.size(),
                options.branching);
  }
  VocabularyTree tree = TreeGrower(dimension, options).Grow(std::move(rows));
  tree.idf.resize(static_cast<size_t>(
      std::count(tree.child_counts.begin(), tree.child_counts.end(), uint16_t{0})));
  const std::vector<int> shown_in = ImagesPerWord(Vocabulary(tree), images);
  for (size_t word = 0; word < tree.idf.size(); ++word) {
    const double count = std::max(shown_in[word], 1);
    tree.idf[word] = static_cast<float>(std::log(static_cast<double>(images.size()) / count));
  }
  return Vocabulary(std::move(tree));
}

QuantisationStatistics MeasureQuantisation(const Vocabulary& vocabulary,
                                           std::span<const Descriptors> images) {
  QuantisationStatistics statistics;
  statistics.images = static_cast<int>(images.size());
  for (const Descriptors& image : images) {
    const std::vector<int> words = vocabulary.WordIndices(image);
    statistics.descriptors += image.size();
    for (int i = 0; i < image.size(); ++i) {
      statistics.mean_similarity +=
          vocabulary.SimilarityToWord(image, i, words[static_cast<size_t>(i)]);
    }
  }
  int64_t shown = 0;
  int most = 0;
  for (const int count : ImagesPerWord(vocabulary, images)) {
    shown += count;
    statistics.used_words += count > 0;
    most = std::max(most, count);
  }
  const auto per = [](double sum, double count) { return count > 0 ? sum / count : 0; };
  statistics.mean_similarity =
      per(statistics.mean_similarity, static_cast<double>(statistics.descriptors));
  statistics.mean_words_per_image = per(static_cast<double>(shown), statistics.images);
  statistics.mean_images_per_word = per(static_cast<double>(shown), statistics.used_words);
  statistics.largest_image_fraction = per(most, statistics.images);
  return statistics;
}

}  // namespace deepuav
