// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/rsi/controller_state.hpp>
#include <kr5/rsi/link_diagnosis.hpp>

namespace kr5::rsi {

/// A telegram of the controller that could be read, with what the answer to it corrects.
struct ReadTelegram {
  const Exchange* exchange = nullptr;
  Ipoc ipoc;
  ControllerState state;
  bool complete = true;  ///< All values of the layout are there.
  std::optional<Correction> correction = {};
};

/// What was observed, read by the codec of the layout.
struct ReadObservations {
  const LinkObservations& seen;
  const TelegramLayout& layout;
  const DiagnosisOptions& options;
  double cycle = 0.0;                              ///< As expected [s].
  double deadline = 0.0;                           ///< Of answers [s].
  TelegramCounts counts = {};                      ///< Of all datagrams.
  std::vector<TelegramFault> faults = {};          ///< Of each.
  std::vector<const Exchange*> of_telegrams = {};  ///< Those that hold a whole <Rob> or <Sen>, whatever its Type.
  std::vector<ReadTelegram> telegrams = {};        ///< Of the controller, in the order of arrival.
  std::vector<std::string> senders = {};           ///< The controller, under each of its ports, first.
  std::size_t controllers = 0;                     ///< How many of them are the controller's.
};

/// @throws InvalidArgument as layout and options.
ReadObservations read_observations(const LinkObservations& seen, const TelegramLayout& layout,
                                   const DiagnosisOptions& options);

/// The value that a share of them does not exceed; 0 of none.
double quantile(std::vector<double> values, double share);
/// What occurs in more than a hundredth of them is a fault.
FindingSeverity severity_by_share(std::uint64_t count, std::uint64_t of);
/// The beginning of bytes, as far as they can be shown.
std::string shown_bytes(const std::string& bytes);

using Findings = std::vector<LinkFinding>;

}  // namespace kr5::rsi
