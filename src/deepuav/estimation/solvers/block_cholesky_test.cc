#include "deepuav/estimation/solvers/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "deepuav/base/random.h"
#include "deepuav/estimation/solvers/block_values.h"
#include "deepuav/estimation/solvers/selected_inverse.h"

namespace deepuav {
namespace {

/// A random positive definite matrix of blocks: a band, and pairs far apart.
template <int kSize>
struct RandomSystem {
  RandomSystem(int columns, int band, int loops, Random* random) {
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < columns; ++i) {
      for (int k = std::max(0, i - band); k < i; ++k) pairs.emplace_back(i, k);
    }
    for (int i = 0; i < loops; ++i) {
      const int a = random->Index(columns), b = random->Index(columns);
      if (a != b) pairs.emplace_back(std::max(a, b), std::min(a, b));
    }
    pattern = BlockPattern::OfPairs(columns, pairs);
    dense.setZero(kSize * columns, kSize * columns);
    for (const auto& [row, column] : pairs) {
      Eigen::MatrixXd jacobian(kSize, kSize * columns);
      jacobian.setZero();
      for (int end : {row, column}) {
        for (int r = 0; r < kSize; ++r) {
          for (int c = 0; c < kSize; ++c) jacobian(r, kSize * end + c) = random->Gaussian(1);
        }
      }
      dense += jacobian.transpose() * jacobian;
    }
    dense.diagonal().array() += 0.1;
    for (int column = 0; column < columns; ++column) {
      for (int c = 0; c < kSize; ++c) {
        for (int i = pattern.begin[column]; i < pattern.begin[column + 1]; ++i) {
          for (int r = 0; r < kSize; ++r) {
            values.push_back(dense(kSize * pattern.rows[i] + r, kSize * column + c));
          }
        }
      }
    }
  }

  BlockPattern pattern;
  std::vector<double> values;
  Eigen::MatrixXd dense;
};

template <int kSize>
void ExpectSolves(int columns, int band, int loops, uint64_t seed) {
  Random random(seed);
  const RandomSystem<kSize> system(columns, band, loops, &random);
  BlockCholesky<kSize> factor(system.pattern);
  Eigen::Matrix<double, Eigen::Dynamic, 3> truth(kSize * columns, 3);
  for (int i = 0; i < truth.size(); ++i) truth.data()[i] = random.Gaussian(1);
  for (int run = 0; run < 2; ++run) {  // The second time on used memory.
    ASSERT_TRUE(factor.Factorise(system.values.data()));
    Eigen::Matrix<double, Eigen::Dynamic, 3> solved = system.dense * truth;
    factor.SolveInPlace(&solved);
    EXPECT_LT((solved - truth).norm(), 1e-9 * truth.norm())
        << columns << " columns, band " << band << ", loops " << loops;
  }
}

TEST(BlockCholesky, SolvesBandsAndLoops) {
  for (uint64_t seed = 0; seed < 5; ++seed) {
    ExpectSolves<7>(40, 3, 5, seed);
    ExpectSolves<6>(60, 2, 40, seed);
    ExpectSolves<6>(30, 30, 0, seed);
    ExpectSolves<3>(50, 1, 0, seed);
  }
  ExpectSolves<7>(1, 0, 0, 1);
  ExpectSolves<7>(5, 0, 0, 1);  // Nothing off the diagonal.
}

TEST(BlockCholesky, AnEmptyMatrixHasNothingToSolve) {
  BlockCholesky<6> factor(BlockPattern::OfPairs(0, {}));
  EXPECT_TRUE(factor.Factorise(nullptr));
  Eigen::Matrix<double, Eigen::Dynamic, 1> nothing(0);
  factor.SolveInPlace(&nothing);
  EXPECT_EQ(nothing.size(), 0);
}

TEST(BlockCholesky, TellsAMatrixThatIsNotPositiveDefinite) {
  Random random(1);
  RandomSystem<6> system(10, 2, 3, &random);
  BlockCholesky<6> factor(system.pattern);
  EXPECT_TRUE(factor.Factorise(system.values.data()));
  system.values[0] = -1;
  EXPECT_FALSE(factor.Factorise(system.values.data()));
  system.values[0] = std::nan("");
  EXPECT_FALSE(factor.Factorise(system.values.data()));
}

TEST(BlockCholesky, TellsAnIndefiniteBlockWithAPositiveDiagonal) {
  const Eigen::Matrix2d indefinite{{1, 2}, {2, 1}};
  BlockCholesky<2> factor(BlockPattern::OfPairs(1, {}));
  EXPECT_FALSE(factor.Factorise(indefinite.data()));
}

TEST(BlockElimination, AChainFillsNothingIn) {
  std::vector<std::pair<int, int>> chain;
  for (int i = 1; i < 100; ++i) chain.emplace_back(i, i - 1);
  const BlockPattern pattern = BlockPattern::OfPairs(100, chain);
  const BlockElimination elimination(pattern);
  EXPECT_EQ(elimination.factor().rows.size(), pattern.rows.size());
  EXPECT_EQ(elimination.products(), 99);
}

TEST(BlockPattern, MergesEqualPairs) {
  const BlockPattern pattern = BlockPattern::OfPairs(3, {{2, 0}, {2, 0}, {1, 0}});
  EXPECT_EQ(pattern.rows, (std::vector<int>{0, 1, 2, 1, 2}));
  EXPECT_EQ(pattern.begin, (std::vector<int>{0, 3, 4, 5}));
}

TEST(SelectedInverse, IsTheDiagonalOfTheInverse) {
  for (const int loops : {0, 1, 15}) {
    Random random(9);
    const RandomSystem<6> system(40, 3, loops, &random);
    BlockCholesky<6> factor(system.pattern);
    ASSERT_TRUE(factor.Factorise(system.values.data()));
    const Eigen::MatrixXd truth = system.dense.inverse();
    const std::vector<Eigen::Matrix<double, 6, 6>> found =
        SelectedInverse<6>(factor).DiagonalBlocks();
    ASSERT_EQ(found.size(), 40);
    for (int i = 0; i < 40; ++i) {
      const Eigen::Matrix<double, 6, 6> block = truth.block<6, 6>(6 * i, 6 * i);
      EXPECT_LT((found[static_cast<size_t>(i)] - block).norm(), 1e-9 * block.norm()) << i;
    }
  }
}

TEST(BlockCholesky, GivesTheSameBytesOnThreads) {
  constexpr int kColumns = 340, kSize = 6;  // Enough for columns that threads share.
  std::vector<std::pair<int, int>> pairs;
  for (int row = 0; row < kColumns; ++row) {
    for (int column = 0; column < row; ++column) pairs.emplace_back(row, column);
  }
  const BlockPattern pattern = BlockPattern::OfPairs(kColumns, pairs);
  Random random(4);
  std::vector<double> values;
  for (int column = 0; column < kColumns; ++column) {
    for (int c = 0; c < kSize; ++c) {
      for (int r = 0; r < kSize * pattern.blocks(column); ++r)
        values.push_back(r == c ? 100 : random.Gaussian(0.01));
    }
  }
  BlockCholesky<kSize> of_one(pattern), of_three(pattern);
  ASSERT_TRUE(of_one.Factorise(values.data()));
  ASSERT_TRUE(of_three.Factorise(values.data(), 3));
  const BlockCholesky<kSize>&alone = of_one, &shared = of_three;
  for (int column = 0; column < kColumns; ++column)
    ASSERT_EQ(shared.FactorColumn(column), alone.FactorColumn(column)) << column;
}

TEST(BlockValues, ABlockLiesWhereThePatternSays) {
  BlockValues<2> values(BlockPattern::OfPairs(4, {{3, 0}, {2, 0}, {3, 2}}));
  values.At(3, 0).setConstant(5);
  values.At(2, 2).setConstant(7);
  EXPECT_EQ(values.Column(0).sum(), 4 * 5);
  EXPECT_TRUE((values.Column(0).bottomRows<2>().array() == 5).all()) << "below (0, 0) and (2, 0)";
  EXPECT_TRUE((values.Column(2).topRows<2>().array() == 7).all());
  EXPECT_EQ(values.Column(1).sum() + values.Column(3).sum(), 0);
  values.Clear();
  EXPECT_EQ(values.Column(0).sum(), 0);
}

}  // namespace
}  // namespace deepuav
