// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/rsi/controller_files.hpp>

/// @file
/// The objects of RSI behind the channels of the Ethernet object, whichever way a controller writes them down.

namespace kr5::rsi {

/// A parameter of an object. Numbers are from 0, as RSI 4 and later count; `number_rsi3` is that of RSI 3, from 1.
struct SignalParameter {
  std::string name;
  int number = 0;
  int number_rsi3 = 0;
  std::string value;
  bool runtime = true;  ///< It may change while the program runs.
};

/// An input, from 0, and the output of another object that it takes.
struct SignalInput {
  int input = 0;
  std::string object;
  int output = 0;
};

struct SignalObject {
  std::string type;  ///< "AxisCorr"
  int type_id = 0;
  std::string id;  ///< "AXISCORR1"
  std::vector<SignalInput> inputs = {};
  std::vector<SignalParameter> parameters = {};
};

struct SignalFlow {
  std::vector<SignalObject> objects;  ///< The Ethernet object is the first one.
  std::vector<std::string> unwired;   ///< Tags.
  std::vector<std::string> unconfirmed;
};

/// @param config_file Name of the sensor configuration.
SignalFlow signal_flow(const TelegramLayout& layout, const ProgramOptions& options, const std::string& config_file);

/// As RSI 3 reads it: `.rsi.xml`.
std::string signal_flow_rsi3(const SignalFlow& flow);
/// As RSI 4, 5 and 6 read it: `.rsix`.
std::string signal_flow_rsix(const SignalFlow& flow, Controller controller);

}  // namespace kr5::rsi
