// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include <kr5/rsi/link_observations.hpp>
#include <kr5/rsi/link_options.hpp>
#include <kr5/rsi/test_motion.hpp>

namespace kr5::rsi {

/// A link that records what it sees. It answers without correction, or with those of a test motion, or, where its
/// options say so, not at all.
class LinkRecorder {
 public:
  /// Listens at once.
  /// @throws InvalidArgument as Link and TestMotion, or for a motion without answers; IoError as Link.
  explicit LinkRecorder(const TelegramLayout& layout, const LinkOptions& options = {},
                        const std::optional<TestMotionOptions>& motion = {});
  ~LinkRecorder();
  LinkRecorder(LinkRecorder&&) noexcept;

  /// Exchanges since the last call; time and all counts since it began. To be called every few seconds, since there is
  /// room for 8 MB.
  LinkObservations take();
  LinkStatistics statistics() const noexcept;
  RealTimeStatus real_time() const noexcept;
  int port() const noexcept;
  /// A test motion was given up.
  bool aborted() const noexcept;

 private:
  struct Record;
  std::unique_ptr<Record> record_;
};

}  // namespace kr5::rsi
