// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/cell.hpp>
#include <kr5/cell/check.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/cell/thing.hpp>
#include <kr5/cell/urdf.hpp>

#include "effect_conversion.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::cell;
using kr5::python::bind_enum;
using kr5::python::bind_struct;
namespace fs = std::filesystem;

static void bind_parts(py::module_& m) {
  bind_enum<CameraMount>(m, "CameraMount", "What carries the camera.");
  m.attr("Link") = py::type::of<Link>();
  bind_struct<Limits>(m, "Limits", "What the joints may do.");
  bind_struct<Robot>(m, "Robot", "The arm.").def_property_readonly("joints", &Robot::joints, "Number of joints.");
  bind_struct<Friction>(m, "Friction", "Friction on the joint side.");
  bind_struct<Drives>(m, "Drives", "Motors and gears.");
  bind_struct<SecondOrder>(m, "SecondOrder", "x'' = wn^2 (u - x) - 2 xi wn x', u the command `delay` earlier.");
  bind_enum<CorrectionMode>(m, "CorrectionMode", "What a path correction is counted from.");
  bind_struct<Correction>(m, "Correction", "How a controller takes path corrections.");
  bind_struct<Servo>(m, "Servo", "How commands become motion.")
      .def("of_joint", &Servo::of_joint, py::arg("index"), "The servo of a joint, counted from 0.");
  bind_struct<Tool>(m, "Tool", "What the flange carries.")
      .def("inertia_matrix", &Tool::inertia_matrix, "3x3 [kg m^2].");
  bind_struct<Peg>(m, "Peg", "The part that is inserted.");
  bind_struct<Tube>(m, "Tube", "The hole.");
  bind_struct<Contact>(m, "Contact", "Contact of the tool with what it presses on.");
  bind_struct<Distortion>(m, "Distortion", "The lens.");
  bind_struct<Camera>(m, "Camera", "The camera.").def("pinhole", &Camera::pinhole, "The same as kr5.Pinhole.");
  bind_struct<Target, kr5::Target>(m, "Target", "A target of the cell: what it is, and where.");
  bind_struct<Thing, kr5::Solid>(m, "Thing", "A solid that stands in the cell.");
  bind_struct<Board>(m, "Board", "The marker board of the short form.")
      .def("target", &Board::target, "The same in the general form.");
  bind_struct<LaserTarget>(m, "LaserTarget", "What the line scanner looks at.");
  bind_struct<Laser>(m, "Laser", "The line scanner.");
  bind_struct<Noise>(m, "Noise", "Standard deviation of one reading of each sensor.");
}

static void bind_effects(py::module_& m) {
  bind_enum<EffectTarget>(m, "EffectTarget", "What an effect sits on.");
  bind_enum<EffectValueKind>(m, "EffectValueKind", "Form of a parameter.");
  bind_struct<EffectParameter>(m, "EffectParameter", "One parameter of an effect, with unit, off value and bounds.");
  bind_struct<Effect>(m, "Effect", "One row of the catalogue.");
  py::class_<Effects>(m, "Effects",
                      "What a cell carries beyond its nominal model: {effect: {target: {parameter: value}}}.")
      .def(py::init(
               [](const py::dict& effects) { return kr5::python::Convert<Effects>::from_python(effects, "effects"); }),
           py::arg("effects") = py::dict(),
           "Raises InvalidArgument for an effect, target or parameter that is not known.")
      .def(
          "get",
          [](const Effects& self, const std::string& effect, const std::string& target, const std::string& parameter) {
            return kr5::python::effect_value(get_effect(self, effect, target, parameter),
                                             kr5::python::kind_of(find_effect(effect), parameter));
          },
          py::arg("effect"), py::arg("target"), py::arg("parameter"), "Value, or None when off means: as in the cell.")
      .def("to_dict", &kr5::python::Convert<Effects>::to_plain, "Nested dict of what is on.")
      .def("__repr__",
           [](const Effects& self) {
             return "Effects(" + py::repr(kr5::python::Convert<Effects>::to_plain(self)).cast<std::string>() + ")";
           })
      .def(
          "__len__", [](const Effects& self) { return active_effects(self).size(); }, "Number of effects that are on.");
  m.def(
      "effect_catalogue", [] { return std::vector<Effect>(effect_catalogue().begin(), effect_catalogue().end()); },
      "Every effect a cell may carry.");
  m.def("find_effect", &find_effect, py::arg("id"), "Row of an effect. Raises InvalidArgument naming the nearest.");
}

static void bind_cell_itself(py::module_& m) {
  bind_struct<Cell>(m, "Cell", "What is believed about a robot cell, and every effect it may carry (kr5-cell/1).")
      .def(
          "flange", [](const Cell& self, const Eigen::VectorXd& q) { return chain(self).flange(q); }, py::arg("q"),
          "T_B_F of the nominal arm for joint values q [rad or m].")
      .def(
          "link_poses", [](const Cell& self, const Eigen::VectorXd& q) { return chain(self).link_poses(q); },
          py::arg("q"), "Poses of link frames 1..n in B for joint values q [rad or m].")
      .def("T_B_E", &T_B_E, py::arg("q"), "Nominal tool tip in the base for joint values q [rad or m].")
      .def("T_F_C", &T_F_C, "Nominal camera in the flange, or None.")
      .def("T_F_L", &T_F_L, "Nominal scanner in the flange, or None.")
      .def("chain", &chain, "The nominal arm.")
      .def(
          "effect_targets",
          [](const Cell& self, const std::string& effect) { return effect_targets(find_effect(effect), self); },
          py::arg("effect"), "Names of what an effect may sit on in this cell.")
      .def(
          "set_effect",
          [](Cell& self, const std::string& effect, const std::string& target, const std::string& parameter,
             const py::object& value) {
            set_effect(self, effect, target, parameter, kr5::python::effect_value(value));
          },
          py::arg("effect"), py::arg("target"), py::arg("parameter"), py::arg("value"),
          "Sets one parameter; None switches it off. Raises InvalidArgument naming what could be set.")
      .def("to_yaml", static_cast<std::string (*)(const Cell&)>(&to_yaml),
           "The file, in the form in which it was read.");
  m.def("load_cell", &load_cell, py::arg("file"),
        "Reads a cell in any of its forms. Raises IoError with file, line and field of everything that is wrong in "
        "form.");
  m.def("parse_cell", &parse_cell, py::arg("yaml"), py::arg("source") = "text", "The same from a text.");
  m.def("save_cell", &save_cell, py::arg("cell"), py::arg("file"),
        "Writes a cell in the form in which it was read; reads back bit for bit.");
}

static void bind_recording(py::module_& m) {
  bind_enum<Kind>(m, "Kind", "What was done.");
  bind_enum<Role>(m, "Role", "given | predicted.");
  bind_enum<Split>(m, "Split", "fit | check.");
  bind_struct<Column>(m, "Column", "One column of a kind of experiment.");
  m.def("columns", &columns, py::arg("kind"), py::arg("joints"), "Columns of a kind for so many joints.");
  bind_struct<Experiment>(m, "Experiment", "One file of a recording.")
      .def_property(
          "data", [](const Experiment& e) { return e.data; },
          [](Experiment& e, const kr5::io::Table& t) { e.data = t; }, "Its numbers (a copy).")
      .def(
          "__getitem__", [](const Experiment& e, const std::string& name) { return e.data.column(name); },
          py::arg("column"), "One column as an array.");
  py::class_<Recording>(m, "Recording", "What a cell did and what its sensors showed (kr5-recording/1).")
      .def(py::init([](Cell cell, std::vector<Experiment> experiments) {
             Recording r;
             r.cell = std::move(cell);
             r.experiments = std::move(experiments);
             return r;
           }),
           py::arg("cell"), py::arg("experiments"))
      .def_property(
          "cell", [](const Recording& r) { return r.cell; }, [](Recording& r, const Cell& c) { r.cell = c; },
          "What is believed about the cell (a copy).")
      .def_property(
          "experiments", [](const Recording& r) { return r.experiments; },
          [](Recording& r, std::vector<Experiment> e) { r.experiments = std::move(e); }, "All of them (copies).")
      .def_property_readonly(
          "folder", [](const Recording& r) { return r.folder; }, "Where it was read from.")
      .def("__getitem__", &Recording::experiment, py::arg("name"), py::return_value_policy::copy,
           "One experiment by name.")
      .def("__repr__", [](const Recording& r) {
        return "Recording(" + r.cell.name + ", " + std::to_string(r.experiments.size()) + " experiments)";
      });
  m.def("load_recording", &load_recording, py::arg("folder"), py::call_guard<py::gil_scoped_release>(),
        "Reads a folder. Raises IoError with file, line and field of everything that is wrong in form.");
  m.def("save_recording", &save_recording, py::arg("recording"), py::arg("folder"),
        py::call_guard<py::gil_scoped_release>(), "Writes a folder; reads back bit for bit.");
}

namespace {

/// Lets a class of Python be a simulator.
class PythonSimulator : public Simulator {
 public:
  PythonSimulator() = default;
  kr5::io::Table predict(const Cell& cell, const Experiment& experiment) const override {
    PYBIND11_OVERRIDE_PURE(kr5::io::Table, Simulator, predict, cell, experiment);
  }
};

}  // namespace

static void bind_simulator(py::module_& m) {
  py::class_<Simulator, PythonSimulator>(m, "Simulator",
                                         "What the sensors of a cell would show in an experiment, noise apart. A class "
                                         "that inherits it and has `predict` can be used wherever a simulator can.")
      .def(py::init<>())
      .def("predict", &Simulator::predict, py::arg("cell"), py::arg("experiment"),
           py::call_guard<py::gil_scoped_release>(),
           "Table of the predicted columns, a row for each row of the experiment. Raises InvalidArgument naming the "
           "part "
           "of the cell, or the given column, that is not there.");
}

static void bind_urdf(py::module_& m) {
  py::class_<UrdfImport>(m, "UrdfImport", "A cell from a URDF.")
      .def_property_readonly(
          "cell", [](const UrdfImport& u) { return u.cell; }, "The cell (a copy).")
      .def_readonly("base", &UrdfImport::base, "Link that became B.")
      .def_readonly("tip", &UrdfImport::tip, "Link that became E.")
      .def_readonly("joints", &UrdfImport::joints, "Names of the joints, from the base.")
      .def_readonly("notes", &UrdfImport::notes, "What the cell cannot hold or the file did not say.");
  m.def(
      "import_urdf",
      [](const fs::path& file, const std::string& base, const std::string& tip) {
        return import_urdf(file, {base, tip});
      },
      py::arg("file"), py::arg("base") = "", py::arg("tip") = "",
      "The serial arm between two links of a robot. Raises IoError with what to do for a file that has none.");
  m.def("to_urdf", &to_urdf, py::arg("cell"), "The arm and the mass of its tool as a URDF.");
  m.def("export_urdf", &export_urdf, py::arg("cell"), py::arg("file"), "The same to a file.");
}

void bind_cell(py::module_& m) {
  m.doc() = "The description of a robot cell and of its recordings.";
  bind_parts(m);
  bind_effects(m);
  bind_cell_itself(m);
  bind_urdf(m);
  bind_recording(m);
  bind_simulator(m);
  using Problems = std::vector<kr5::io::Problem>;
  m.def("check", static_cast<Problems (*)(const fs::path&)>(&check), py::arg("path"),
        py::call_guard<py::gil_scoped_release>(),
        "Everything that is wrong, or looks wrong, with a cell file, a recording, or all of them below a folder.\n\n"
        "Returns\n-------\nlist of kr5.io.Problem\n    Empty when clean.");
  m.def("check", static_cast<Problems (*)(const Cell&)>(&check), py::arg("cell"));
  m.def("check", static_cast<Problems (*)(const Recording&)>(&check), py::arg("recording"));
  m.def("find_documents", &find_documents, py::arg("path"),
        "The cell files and recording.yaml files that check looks at.");
}
