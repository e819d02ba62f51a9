// SPDX-License-Identifier: BSD-3-Clause
// An effect of one's own, fitted beside those of the catalogue: a current sensor that bends.  05_own_effect SHARE
#include <cmath>
#include <cstdio>

#include <kr5/gap/diagnose.hpp>
#include <kr5/predict/fast_simulator.hpp>

using namespace kr5;

// A motion of joint 2, and its current as the bent sensor shows it.
static cell::Experiment moved(const cell::Cell& cell, const std::string& name, cell::Split split, double rate) {
  const double home[] = {0.0, 0.02, -2.75, 0.0, -0.3, 1.571};
  cell::Experiment out{name, cell::Kind::Motion, name + ".csv", split, {{"t"}, Eigen::MatrixXd(800, 7)}};
  for (int j = 1; j <= 6; ++j) out.data.columns.push_back("qc" + std::to_string(j));
  for (int i = 0; i < 800; ++i) {
    const double t = 0.012 * i;
    out.data.values(i, 0) = t;
    for (int j = 0; j < 6; ++j) out.data.values(i, j + 1) = home[j];
    out.data.values(i, 2) += 0.4 * std::sin(rate * t) * (1 - std::exp(-t * t));
  }
  const Eigen::VectorXd i2 = predict::FastSimulator().predict(cell, out).column("i2");
  out.data.columns.emplace_back("i2");
  out.data.values.conservativeResize(Eigen::NoChange, 8);
  for (int i = 0; i < 800; ++i) {
    double noise = 12.9898 * std::sin(78.233 * i + rate) * 43.7585;  // of no true random numbers, alike everywhere
    noise = std::sqrt(12.0) * cell.noise.current * (noise - std::floor(noise) - 0.5);
    out.data.values(i, 7) = i2(i) + 0.02 * i2(i) * i2(i) + noise;
  }
  return out;
}

int main(int, char** argv) {
  cell::Recording recording;
  recording.cell = cell::load_cell(std::string(argv[1]) + "/cells/kr5_arc.yaml");
  recording.cell.effects = {};
  recording.experiments = {moved(recording.cell, "slow", cell::Split::Fit, 1.3),
                           moved(recording.cell, "fast", cell::Split::Fit, 2.9),
                           moved(recording.cell, "other", cell::Split::Check, 2.1)};
  gap::OwnEffect own{{"bent_sensor", "i2"}, {{"bend", "1/A", 0.01, -0.5, 0.5, {}}}, {}, {}};
  own.change = [](io::Table& table, const cell::Experiment&, const Eigen::VectorXd& x) {
    if (const int at = table.find("i2"); at >= 0)
      table.values.col(at).array() += x(0) * table.values.col(at).array().square();
  };
  gap::DiagnoseOptions options;
  options.own_hypotheses = {gap::own_hypothesis(own)};
  const gap::Diagnosis found = gap::diagnose(recording, predict::FastSimulator(), options);
  std::printf("%s\n", std::string(name_of(found.verdict)).c_str());
  for (const gap::Cause& cause : found.causes)
    for (const gap::ParameterEstimate& p : cause.parameters)
      std::printf("%s on %s: %s %.4f +- %.4f %s\n", cause.effect.c_str(), cause.target.c_str(), p.name.c_str(),
                  p.value[0], p.std[0], p.unit.c_str());
  std::printf("gap %.1f -> %.1f\n", found.reduction.before, found.reduction.after);
}
