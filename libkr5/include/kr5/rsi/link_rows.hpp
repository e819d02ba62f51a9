// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/rsi/controller_state.hpp>
#include <kr5/rsi/link_observations.hpp>
#include <kr5/rsi/telegram_codec.hpp>

/// @file
/// What a controller told, as rows of numbers by names that a log has.

namespace kr5::rsi {

/// A telegram that could not be used.
struct FaultyTelegram {
  double time = 0.0;  ///< [s]
  TelegramFault fault = TelegramFault::None;
  std::string sender;

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Arrival, since listening began [s].");
    visit("fault", self.fault, "What is wrong with it.");
    visit("sender", self.sender, "Who sent it.");
  }
};

struct LinkRows {
  Eigen::MatrixXd values;  ///< A row a telegram.
  std::vector<FaultyTelegram> faulty;

  static void each_field(auto& self, auto&& visit) {
    visit("values", self.values, "A row for each telegram, a column for each name.");
    visit("faulty", self.faulty, "Telegrams that could not be used.");
  }
};

/// Makes rows of exchanges that come bit by bit. The time of a row is that of IPOC, since the arrival of the first
/// telegram of a series; it rises from row to row, also where a controller restarts. Telegrams that come twice or late,
/// and those of a second sender, are no rows.
class LinkRowReader {
 public:
  /// @throws InvalidArgument as TelegramLayout::validate.
  explicit LinkRowReader(const TelegramLayout& layout);

  /// `t` [s], `ipoc`, and as far as the layout has them `q1`, `qc1` [rad or m], `i1` [A], `tau1` [N m], `x`, `y`, `z`
  /// [m], `rx`, `ry`, `rz` (rotation vector) [rad], `late_packets`, `program_state`; then `answer_time` [s], NaN
  /// without an answer.
  const std::vector<std::string>& names() const noexcept { return names_; }
  LinkRows read(const LinkObservations& observations);

 private:
  bool advance(const Exchange& exchange, const Ipoc& ipoc);
  std::vector<double> row(const Exchange& exchange, const Telegram& telegram) const;

  TelegramCodec codec_;
  TelegramUnits units_;
  std::vector<std::string> names_;
  std::optional<Ipoc> last_ipoc_;
  std::string sender_;
  double last_arrival_ = 0.0, time_ = 0.0;
};

}  // namespace kr5::rsi
