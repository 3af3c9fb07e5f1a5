// Kernels of implicit steps, compared with plain loops.
#include "core/base/bits.h"
#include "plugins/solvers/particles/aggregate_matrix.h"
#include "plugins/solvers/particles/block_kernels.h"
#include "plugins/solvers/particles/float_springs.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;
using sim::Mat3;
using sim::Vec3;

namespace {

constexpr int kEntries[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};  // of xx xy xz yy yz zz

// Symmetric blocks of particles, and what is made of them; columns are as long as a layout's.
template <class Number>
struct BlocksOf {
  ColumnOf<Number> entry[6];
  Number* to[6];
  const Number* from[6];

  explicit BlocksOf(int items) {
    for (int k = 0; k < 6; ++k) {
      entry[k] = ColumnOf<Number>(items);
      to[k] = entry[k].data();
      from[k] = entry[k].data();
    }
  }
  BlocksOf(const BlocksOf&) = delete;
  BlocksOf& operator=(const BlocksOf&) = delete;
  double at(int i, int row, int column) const { return entry[kEntries[row][column]][i]; }
  void set(int i, const Mat3& m) {
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = row; column < 3; ++column)
        entry[kEntries[row][column]][i] = static_cast<Number>(m(row, column));
  }
  Vec3 times(int i, const Vec3& v) const {
    Vec3 sum = Vec3::Zero();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        sum[static_cast<std::size_t>(row)] +=
            at(i, row, column) * v[static_cast<std::size_t>(column)];
    return sum;
  }
};
using Blocks = BlocksOf<double>;

// s s^T-like blocks, positive definite.
Mat3 definite(int i, double size) {
  Mat3 m = Mat3::Zero();
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      m(row, column) =
          size * (row == column ? 3 + scattered(i, 50 + static_cast<int>(row))
                                : 0.6 * scattered(i, 60 + static_cast<int>(row + column)));
  return m;
}

template <class Number>
Vec3 at(const AxesOf<Number>& axes, int i) {
  return {axes[0][i], axes[1][i], axes[2][i]};
}

bool near(const Vec3& got, const Vec3& want, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!agree(got[k], want[k], tolerance)) return false;
  return true;
}

int padded(int items) { return (items + 7) / 8 * 8; }

double sum_of(const double (&lanes)[8]) {
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

// Vectors of a layout are 0 on the padding behind the particles.
Axes layout_axes(int items, int field) {
  Axes axes(padded(items));
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < items; ++i) axes[k][i] = scattered(i, 3 * field + k);
  return axes;
}

}  // namespace

TEST_CASE("blocks are inverted as one by one", "[block_kernel]") {
  for_each_lane([](int items, int extreme) {
    // Much larger or smaller than the others, not definite, singular, and nothing.
    for (int kind = 0; kind < 5; ++kind) {
      Blocks blocks(items), inverses(items);
      for (int i = 0; i < items; ++i) blocks.set(i, definite(i, 1 + i));
      Mat3 odd = definite(extreme, kind == 0 ? 1e150 : kind == 1 ? 1e-150 : 2.0);
      if (kind == 2) odd(0, 0) = -odd(0, 0);
      if (kind == 3) odd = Mat3::Zero();
      if (kind == 3) odd(1, 1) = 5;
      if (kind == 4) odd = Mat3::Zero();
      blocks.set(extreme, odd);
      const auto free = bits_where(items, [](int i) { return i % 6 != 1; });
      sim::block_kernels().invert(blocks.from, free.data(), inverses.to, 0, items);
      for (int i = 0; i < items; ++i) {
        CAPTURE(kind, i);
        const bool regular = i != extreme || kind < 2;
        double worst = 0;
        for (int column = 0; column < 3; ++column) {
          Vec3 unit = Vec3::Zero();
          unit[static_cast<std::size_t>(column)] = 1;
          const Vec3 got = inverses.times(i, unit);
          Vec3 want = regular ? blocks.times(i, got) : got;
          if (!sim::bit(free.data(), i)) {
            worst = std::fmax(worst, got.norm());
            continue;
          }
          if (!regular) {
            const double trace =
                std::fabs(blocks.at(i, 0, 0) + blocks.at(i, 1, 1) + blocks.at(i, 2, 2));
            want = got * (trace > 0 ? trace : 1);
          }
          worst = std::fmax(worst, (want - unit).norm());
        }
        if (!(worst < 1e-12)) FAIL_CHECK("off by " << worst);
      }
    }
  });
}

TEST_CASE("blocks are multiplied as one by one", "[block_kernel]") {
  for_each_lane([](int items, int extreme) {
    const int end = padded(items);
    Blocks inverses(end);
    for (int i = 0; i < items; ++i) inverses.set(i, definite(i, 1));
    Axes r = layout_axes(items, 0), z = layout_axes(items, 1), p = layout_axes(items, 2),
         a = layout_axes(items, 3), d = layout_axes(items, 4);
    r[extreme % 3][extreme] = -1e5;
    p[extreme % 3][extreme] = 1e5;
    const double alpha = 0.3, beta = -0.7;
    Axes turned = p;
    const Axes r_before = r, d_before = d, p_before = p;
    double sums[8] = {}, plain = 0;
    sim::block_kernels().multiply(inverses.from, inputs(r), outputs(z), 0, end, sums);
    bool good = true;
    for (int i = 0; i < items; ++i) {
      const Vec3 want = inverses.times(i, at(r, i));
      good &= near(at(z, i), want, 1e-9);
      plain += want.dot(at(r, i));
    }
    CHECK(good);
    CHECK(sum_of(sums) == Approx(plain).epsilon(1e-12));

    double products[8] = {};
    for (int k = 0; k < 3; ++k)
      sim::block_kernels().dot(r[k].data(), p[k].data(), static_cast<std::size_t>(end), products);
    double product = 0;
    for (int i = 0; i < items; ++i) product += at(r, i).dot(at(p, i));
    CHECK(sum_of(products) == Approx(product).epsilon(1e-12).margin(1e-8));

    double after[8] = {}, plain_after = 0;
    sim::block_kernels().advance(alpha, inputs(p), inputs(a), outputs(d), outputs(r), inverses.from,
                                 outputs(z), 0, end, after);
    good = true;
    for (int i = 0; i < items; ++i) {
      const Vec3 rest = at(r_before, i) - alpha * at(a, i), want = inverses.times(i, rest);
      good &= near(at(r, i), rest, 1e-9) && near(at(z, i), want, 1e-9) &&
              near(at(d, i), at(d_before, i) + alpha * at(p, i), 1e-9);
      plain_after += want.dot(rest);
    }
    CHECK(good);
    CHECK(sum_of(after) == Approx(plain_after).epsilon(1e-12));

    sim::block_kernels().turn(beta, inputs(z), outputs(turned), 0, end);
    good = true;
    for (int i = 0; i < items; ++i)
      good &= near(at(turned, i), at(z, i) + beta * at(p_before, i), 1e-9);
    CHECK(good);
  });
}

namespace {

constexpr int kRow = sim::AggregateKernels::kRow, kBlock = sim::AggregateKernels::kBlock;

// A ring of patches, each with edges to itself and to its neighbours.
sim::WeightedGraph ring_of(int aggregates) {
  sim::WeightedGraph graph;
  for (int i = 0; i < aggregates; ++i) {
    graph.begin.push_back(static_cast<int>(graph.to.size()));
    for (int k = 0; k <= std::min(i % 4, aggregates - 1); ++k)
      graph.to.push_back((i + k) % aggregates);
  }
  graph.begin.push_back(static_cast<int>(graph.to.size()));
  graph.weight.assign(graph.to.size(), 1);
  return graph;
}

// sum += block x, of six columns of eight.
void add_block(const std::vector<float>& blocks, int at, const double* x, double* sum) {
  for (int column = 0; column < 6; ++column)
    for (int row = 0; row < kRow; ++row)
      sum[row] +=
          double{blocks[static_cast<std::size_t>(at * kBlock + column * kRow + row)]} * x[column];
}

}  // namespace

TEST_CASE("matrices of patches are multiplied as by plain loops", "[aggregate_kernel]") {
  for_each_lane([](int items, int extreme) {
    const sim::WeightedGraph graph = ring_of(items);
    std::vector<float> blocks(graph.to.size() * kBlock);
    for (std::size_t i = 0; i < blocks.size(); ++i)
      blocks[i] = static_cast<float>(scattered(static_cast<int>(i), 1));
    Column r(items * kRow), x(items * kRow), out(items * kRow), plain(items * kRow);
    scatter(r, 2);
    scatter(x, 3);
    x[extreme * kRow + extreme % 6] = 1e4;
    for (int i = 0; i < items; ++i) {
      double sum[kRow] = {};
      for (int e = graph.begin[static_cast<std::size_t>(i)];
           e < graph.begin[static_cast<std::size_t>(i) + 1]; ++e)
        add_block(blocks, e, x.data() + kRow * graph.to[static_cast<std::size_t>(e)], sum);
      for (int row = 0; row < kRow; ++row) plain[i * kRow + row] = r[i * kRow + row] - sum[row];
    }
    sim::aggregate_kernels().residual(graph, blocks.data(), r.data(), x.data(), out.data(), 0,
                                      items);
    CHECK(first_difference(out, plain, 1e-9) == -1);
    CHECK(out[items * kRow] == 7777);
    for (const bool add : {false, true}) {
      Column relaxed = x;
      Column want(items * kRow);
      for (int i = 0; i < items; ++i) {
        double sum[kRow] = {};
        add_block(blocks, i, r.data() + i * kRow, sum);
        for (int row = 0; row < kRow; ++row)
          want[i * kRow + row] = (add ? x[i * kRow + row] : 0) + 0.4 * sum[row];
      }
      sim::aggregate_kernels().relax(blocks.data(), 0.4, r.data(), relaxed.data(), add, 0, items);
      CHECK(first_difference(relaxed, want, 1e-9) == -1);
      CHECK(relaxed[items * kRow] == 7777);
    }
  });
}

namespace {

struct SingleCase {
  std::vector<std::uint8_t> owners;
  ColumnOf<float> along;
  AxesOf<float> w;
  sim::FloatSpringRun run;

  SingleCase(int items, int stride)
      : owners(bits_where(items, [=](int a) { return a + stride < items && a % 5 != 2; })),
        along(items, 0),
        w(items),
        run{owners.data(), stride, along.data(), {w[0].data(), w[1].data(), w[2].data()}} {
    for (int k = 0; k < 3; ++k) w[k] = ColumnOf<float>(items, 0);
    for (int k = 0; k < 3; ++k) run.w[k] = w[k].data();
  }
  SingleCase(const SingleCase&) = delete;
  SingleCase& operator=(const SingleCase&) = delete;
  bool owns(int a) const { return sim::bit(owners.data(), a); }
};

}  // namespace

TEST_CASE("springs become single precision as one by one", "[float_springs_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const int stride : {1, 3, 9}) {
      SingleCase single(items, stride);
      Column along(items), across(items), parts(items);
      Axes q(items);
      scatter(q, 0);
      for (int i = 0; i < items; ++i) {
        along[i] = single.owns(i) ? 3 * scattered(i, 9) : 0;
        across[i] = single.owns(i) ? 1 + 1.5 * scattered(i, 10) : 0;  // below 0 for some
        parts[i] = 0.5 + 0.4 * scattered(i, 11);
      }
      if (single.owns(extreme)) {
        along[extreme] = -1e4;
        across[extreme] = 1e6;
        parts[extreme] = 0.01;
      }
      sim::SpringRun springs;
      springs.stride = stride;
      springs.owners = single.owners;
      const sim::StiffRun from{sim::RunColumns(springs), along.data(), across.data()};
      const double scale = 0.25;
      sim::float_spring_kernels().narrow(from, inputs(q), parts.data(), scale, single.run, 0,
                                         items);
      for (int a = 0; a < items; ++a) {
        double want = 0, size = 0;
        Vec3 d = Vec3::Zero();
        if (single.owns(a)) {
          d = at(q, a) - at(q, a + stride);
          want = scale * along[a];
          if (want < 0) want *= std::fmin(parts[a], parts[a + stride]);
          size = std::sqrt(std::fmax(scale * across[a], 0));
        }
        bool good = agree(double{single.along[a]}, want, 1e-6 * std::fabs(want));
        for (int k = 0; k < 3; ++k) {
          const double w = size * d[static_cast<std::size_t>(k)];
          good &= agree(double{single.w[k][a]}, w, 1e-6 * std::fabs(w));
        }
        if (!good) FAIL_CHECK("stride " << stride << ", spring " << a);
      }
    }
  });
}

TEST_CASE("products in single precision are those of plain loops", "[float_springs_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const int stride : {1, 3, 9, 17}) {
      SingleCase single(items, stride);
      for (int a = 0; a < items; ++a) {
        if (!single.owns(a)) continue;
        single.along[a] = static_cast<float>(1 + scattered(a, 1));
        for (int k = 0; k < 3; ++k) single.w[k][a] = static_cast<float>(scattered(a, 2 + k));
      }
      if (single.owns(extreme)) single.w[1][extreme] = 90;
      AxesOf<float> r(items), x(items), out(items), before(items);
      scatter(r, 3);
      scatter(x, 4);
      x[2][extreme] = 50;
      scatter(before, 5);
      ColumnOf<float> shift(items);
      for (int i = 0; i < items; ++i) shift[i] = static_cast<float>(2 + 0.1 * i);
      BlocksOf<float> inverses(items);
      Blocks diagonal(items), plain_diagonal(items);
      for (int i = 0; i < items; ++i) {
        inverses.set(i, definite(i, 1));
        plain_diagonal.set(i, Mat3::Identity() * double{shift[i]});
      }
      const auto free = bits_where(items, [](int i) { return i % 7 != 4; });
      std::vector<Vec3> springs(static_cast<std::size_t>(items), Vec3::Zero());
      for (int a = 0; a < items; ++a) {
        if (!single.owns(a)) continue;
        const int b = a + stride;
        const Vec3 e = at(x, a) - at(x, b), w = at(single.w, a);
        const Vec3 f = double{single.along[a]} * e + w.dot(e) * w;
        springs[static_cast<std::size_t>(a)] += f;
        springs[static_cast<std::size_t>(b)] -= f;
        for (const int end : {a, b})
          for (std::size_t row = 0; row < 3; ++row)
            for (std::size_t column = row; column < 3; ++column)
              plain_diagonal.entry[kEntries[row][column]][end] +=
                  (row == column ? double{single.along[a]} : 0) + w[row] * w[column];
      }
      sim::float_spring_kernels().diagonal({&single.run, 1}, shift.data(), diagonal.to, 0, items);
      for (int k = 0; k < 6; ++k)
        CHECK(first_difference(diagonal.entry[k], plain_diagonal.entry[k], 1e-3) == -1);
      for (const bool relax : {false, true})
        for (const bool nets : {false, true}) {
          for (int k = 0; k < 3; ++k) out[k] = before[k];
          sim::FloatSpringProduct product{};
          product.runs = {&single.run, 1};
          product.shift = shift.data();
          product.free = free.data();
          product.before = nets;
          for (int k = 0; k < 6; ++k) product.inverses[k] = inverses.from[k];
          for (int k = 0; k < 3; ++k) {
            product.r[k] = r[k].data();
            product.x[k] = x[k].data();
            product.out[k] = out[k].data();
          }
          (relax ? sim::float_spring_kernels().relax : sim::float_spring_kernels().residual)(
              product, 0, items);
          for (int i = 0; i < items; ++i) {
            Vec3 want = Vec3::Zero();
            if (sim::bit(free.data(), i)) {
              Vec3 sum = springs[static_cast<std::size_t>(i)];
              if (nets) sum += at(before, i);
              want = at(r, i) - (double{shift[i]} * at(x, i) + sum);
              if (relax) want = at(x, i) + inverses.times(i, want);
            }
            CAPTURE(stride, relax, nets, i);
            if (!near(at(out, i), want, 1e-5 * (want.norm() + 10)))
              FAIL_CHECK((at(out, i) - want).norm());
          }
        }
    }
  });
}
