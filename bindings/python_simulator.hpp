// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>

#include <kr5/cell/simulator.hpp>
#include <kr5/core/error.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "conversion.hpp"

/// @file
/// Functions and simulators of Python, called from any thread.

namespace kr5::python {

/// A Python object that may be copied and dropped without the interpreter held.
class Shared {
 public:
  explicit Shared(py::object object)
      : object_(new py::object(std::move(object)), [](py::object* last) {
          const py::gil_scoped_acquire held;
          delete last;
        }) {}

  const py::object& operator*() const { return *object_; }

 private:
  std::shared_ptr<py::object> object_;
};

/// Calls a user's function with the interpreter held. What it raises keeps its type and says where it was called;
/// kr5.InvalidArgument becomes ours, which a diagnosis may live with (a part that the cell does not have).
template <class Call>
auto call_python(const std::string& where, const Call& call) {
  const py::gil_scoped_acquire held;
  try {
    return call();
  } catch (py::error_already_set& error) {
    if (error.matches(py::module_::import("kr5").attr("InvalidArgument"))) {
      const std::string text = py::str(error.value());
      throw InvalidArgument(text);
    }
    error.value().attr("add_note")("raised in " + where + ", which kr5 called");
    throw;
  }
}

/// A table from what a simulator of Python returned: kr5.io.Table, or a dict of columns.
inline io::Table table_from(const py::object& value, const std::string& where) {
  if (py::isinstance<io::Table>(value)) return value.cast<io::Table>();
  if (!py::isinstance<py::dict>(value)) complain(where, "a kr5.io.Table or a dict of columns", value);
  io::Table out;
  for (const auto& [name, column] : py::reinterpret_borrow<py::dict>(value)) {
    const std::string key = py::str(name);
    const auto numbers = cast_or_complain<Eigen::VectorXd>(column, where + "['" + key + "']");
    if (out.columns.empty()) out.values.resize(numbers.size(), static_cast<Eigen::Index>(py::len(value)));
    if (numbers.size() != out.values.rows())
      throw py::value_error(where + "['" + key + "']: found " + std::to_string(numbers.size()) + " rows, expected " +
                            std::to_string(out.values.rows()) + " as in the others");
    out.values.col(static_cast<Eigen::Index>(out.columns.size())) = numbers;
    out.columns.push_back(key);
  }
  return out;
}

/// Any Python object with `predict(cell, experiment)`.
class ObjectSimulator : public cell::Simulator {
 public:
  explicit ObjectSimulator(py::object object) : object_(std::move(object)) {}

  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override {
    return call_python("predict of the simulator, experiment " + experiment.name, [&] {
      io::Table out = table_from((*object_).attr("predict")(cell, experiment), "predict");
      if (out.values.rows() != experiment.data.values.rows())
        throw py::value_error("predict: found " + std::to_string(out.values.rows()) + " rows, expected " +
                              std::to_string(experiment.data.values.rows()) + ", one for each row of experiment " +
                              experiment.name);
      return out;
    });
  }

 private:
  Shared object_;
};

/// The simulator that a Python object is: what C++ made as it is, everything else by its method `predict`; the fast one
/// for None.
inline std::shared_ptr<const cell::Simulator> simulator_from(const py::object& object) {
  if (object.is_none()) return std::make_shared<predict::FastSimulator>();
  const py::object base = py::type::of<cell::Simulator>();
  const bool ours =
      py::isinstance<cell::Simulator>(object) && py::type::of(object).attr("predict").is(base.attr("predict"));
  if (ours) return {object.cast<const cell::Simulator*>(), [](const cell::Simulator*) {}};
  if (!py::hasattr(object, "predict"))
    complain("simulator", "an object with predict(cell, experiment), such as kr5.predict.FastSimulator()", object);
  return std::make_shared<ObjectSimulator>(object);
}

}  // namespace kr5::python
