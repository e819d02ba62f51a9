// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/cell.hpp>
#include <kr5/cell/check.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/cell/effect_registry.hpp>
#include <kr5/cell/export_urdf.hpp>
#include <kr5/cell/import_urdf.hpp>
#include <kr5/cell/placed_object.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>

#include "column_conversion.hpp"
#include "effect_conversion.hpp"
#include "python_simulator.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::cell;
using kr5::python::bind_enum;
using kr5::python::bind_struct;
namespace fs = std::filesystem;

static void bind_parts(py::module_& m) {
  m.attr("Link") = py::type::of<Link>();
  bind_struct<Limits>(m, "Limits", "Limits of the joints.");
  bind_struct<Gears>(m, "Gears", "Gears between motors and links.");
  bind_struct<Robot>(m, "Robot", "Robot arm.").def_property_readonly("joints", &Robot::joints, "Number of joints.");
  bind_struct<Friction>(m, "Friction", "Friction on the joint side.");
  bind_struct<Drives>(m, "Drives", "Motors and gears.");
  bind_struct<SecondOrder>(m, "SecondOrder", "x'' = wn^2 (u - x) - 2 xi wn x', u the command `delay` earlier.");
  bind_enum<CorrectionMode>(m, "CorrectionMode", "Reference of a path correction.");
  bind_struct<Correction>(m, "Correction", "Path correction of a controller.");
  bind_struct<Servo>(m, "Servo", "Servo of the axes and of the path correction.")
      .def("of_joint", &Servo::of_joint, py::arg("index"), "The servo of a joint, counted from 0.");
  bind_struct<Tool>(m, "Tool", "Tool on the flange.").def("inertia_matrix", &Tool::inertia_matrix, "3x3 [kg m^2].");
  bind_struct<Peg>(m, "Peg", "Peg that is inserted.");
  bind_struct<Tube>(m, "Tube", "Tube that receives the peg.");
  bind_struct<Contact>(m, "Contact", "Contact of the tool with its surroundings.");
  bind_struct<Distortion>(m, "Distortion", "Lens distortion.");
  bind_struct<Camera>(m, "Camera", "Camera.").def("pinhole", &Camera::pinhole, "Intrinsics as kr5.Pinhole.");
  bind_struct<Target, kr5::Target>(m, "Target", "Target of the cell with its pose.");
  bind_struct<PlacedObject, kr5::Solid>(m, "PlacedObject", "A solid that stands in the cell.");
  bind_struct<Board>(m, "Board", "Marker board.").def("target", &Board::target, "The board as a general target.");
  bind_struct<LaserTarget>(m, "LaserTarget", "Object measured by the line scanner.");
  bind_struct<Laser>(m, "Laser", "Line scanner.");
  bind_struct<Noise>(m, "Noise", "Standard deviation of one reading of each sensor.");
}

static py::dict values_of(const ActiveEffect& effect) {
  py::dict out;
  for (const auto& [name, value] : effect.parameters)
    out[py::str(name)] = kr5::python::effect_value(value, kr5::python::kind_of(find_effect(effect.id), name));
  return out;
}

static void register_from_python(Effect effect, const py::object& change_cell, const py::object& change_columns) {
  using kr5::python::call_python;
  using kr5::python::Shared;
  const std::string of = " of the effect " + effect.id;
  if (!change_cell.is_none())
    effect.change_cell = [function = Shared(change_cell), of](Cell& cell, const ActiveEffect& active) {
      call_python("change_cell" + of, [&] {
        const py::object copy = py::cast(cell), out = (*function)(copy, active.target, values_of(active));
        cell = kr5::python::cast_or_complain<Cell>(out.is_none() ? copy : out, "change_cell" + of);
      });
    };
  if (!change_columns.is_none())
    effect.change_columns = [function = Shared(change_columns), of](kr5::io::Table& table, const Experiment& experiment,
                                                                    const ActiveEffect& active) {
      call_python("change_columns" + of, [&] {
        const py::dict columns = kr5::python::columns_to_dict(table);
        const py::object out = (*function)(columns, experiment, active.target, values_of(active));
        if (!out.is_none() && !py::isinstance<py::dict>(out))
          kr5::python::complain("change_columns" + of, "a dict of columns, or None", out);
        kr5::python::put_back_columns(table, out.is_none() ? columns : py::reinterpret_borrow<py::dict>(out));
      });
    };
  register_effect(std::move(effect));
}

static void bind_effects(py::module_& m) {
  bind_enum<EffectTarget>(m, "EffectTarget", "What an effect sits on.");
  bind_enum<EffectValueKind>(m, "EffectValueKind", "Form of a parameter.");
  bind_enum<CoordinateKind>(m, "CoordinateKind", "How a parameter follows from the coordinates of a search.");
  bind_struct<EffectParameter>(m, "EffectParameter", "One parameter of an effect, with unit, off value and bounds.")
      .def_property_readonly(
          "measures_size", &EffectParameter::measures_size,
          "Whether the parameter tells by itself how large the effect is; a time constant does not.");
  bind_struct<Effect>(m, "Effect", "One row of the catalogue: everything the library knows of an effect but its law.")
      .def_property_readonly("periodic", &Effect::periodic, "Whether it is periodic in the angle of its joint.");
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
  m.def("effect_catalogue", &effect_catalogue, "Every effect a cell may carry.");
  m.def(
      "register_effect", &register_from_python, py::arg("effect"), py::kw_only(), py::arg("change_cell") = py::none(),
      py::arg("change_columns") = py::none(),
      "Adds an effect of one's own to the catalogue, with its law: it may stand in cell files, is checked, simulated, "
      "diagnosed and explained like any other.\n\n"
      "change_cell(cell, target, values) -> cell: sets it in the cell that is simulated (a copy, which may be changed; "
      "None means that it was). change_columns(columns, experiment, target, values) -> dict: changes what the "
      "simulator predicts, a dict of arrays with one value for each row of the experiment. values: dict of the "
      "parameters. One of the two is needed. Both are called often, from any thread, one call at a time. Raises "
      "InvalidArgument for an id that is in the catalogue, or a row that lacks something.");
  m.def("unregister_effect", &unregister_effect, py::arg("id"),
        "Takes a registered effect out of the catalogue. Raises InvalidArgument for one of the library.");
  m.def("find_effect", &find_effect, py::arg("id"), "Row of an effect. Raises InvalidArgument naming the nearest.");
}

static void bind_cell_itself(py::module_& m) {
  bind_struct<Cell>(m, "Cell", "Nominal model of a robot cell with its active effects (kr5-cell/1).")
      .def(
          "flange", [](const Cell& self, const Eigen::VectorXd& q) { return nominal_chain(self).flange(q); },
          py::arg("q"), "T_base_flange of the nominal arm for joint values q [rad or m].")
      .def(
          "link_poses", [](const Cell& self, const Eigen::VectorXd& q) { return nominal_chain(self).link_poses(q); },
          py::arg("q"), "Poses of link frames 1..n in B for joint values q [rad or m].")
      .def("T_base_tool", &T_base_tool, py::arg("q"), "Nominal tool tip in the base for joint values q [rad or m].")
      .def("T_flange_camera", &T_flange_camera, "Nominal camera in the flange, or None.")
      .def("T_flange_scanner", &T_flange_scanner, "Nominal scanner in the flange, or None.")
      .def("nominal_chain", &nominal_chain, "The nominal arm.")
      .def(
          "effect_targets",
          [](const Cell& self, const std::string& effect) { return effect_targets(find_effect(effect), self); },
          py::arg("effect"), "Names of what an effect may sit on in this cell.")
      .def(
          "nominal_value",
          [](const Cell& self, const std::string& effect, const std::string& target, const std::string& parameter,
             int choice) {
            return kr5::python::effect_value(nominal_value(self, effect, target, parameter, choice),
                                             kr5::python::kind_of(find_effect(effect), parameter));
          },
          py::arg("effect"), py::arg("target"), py::arg("parameter"), py::arg("choice") = 0,
          "What the cell says of a parameter that an effect replaces; None for an addition. choice: value of the "
          "effect's parameter that is a choice, such as the source of crosstalk. Raises InvalidArgument naming what "
          "there is.")
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
  m.def(
      "compared_columns", &compared_columns, py::arg("kind"), py::arg("joints"),
      "Columns in which a recording and a simulation are compared: those predicted with noise, an orientation as rx ry "
      "rz [rad].");
  m.def(
      "find_column", [](Kind kind, const std::string& name) { return find_column(kind, name); }, py::arg("kind"),
      py::arg("name"), "A column of a kind by its name, rx ry rz too. Raises InvalidArgument for one it has not.");
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
  kr5::io::Table simulate(const Cell& cell, const Experiment& experiment) const override {
    PYBIND11_OVERRIDE_PURE_NAME(kr5::io::Table, Simulator, "predict", simulate, cell, experiment);
  }
};

}  // namespace

static void bind_simulator(py::module_& m) {
  py::class_<Simulator, PythonSimulator>(m, "Simulator",
                                         "What the sensors of a cell would show in an experiment, noise apart. A class "
                                         "that inherits it and has `predict` can be used wherever a simulator can.")
      .def(py::init<>())
      .def(
          "predict",
          [](const Simulator& self, const Cell& cell, const Experiment& experiment) {
            cell.validate();
            return self.predict(cell, experiment);
          },
          py::arg("cell"), py::arg("experiment"), py::call_guard<py::gil_scoped_release>(),
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
  using Problems = std::vector<kr5::io::Diagnostic>;
  m.def("check", static_cast<Problems (*)(const fs::path&)>(&check), py::arg("path"),
        py::call_guard<py::gil_scoped_release>(),
        "Errors and warnings of a cell file, a recording, or all of them below a folder.\n\n"
        "Returns\n-------\nlist of kr5.io.Diagnostic\n    Empty when clean.");
  m.def("check", static_cast<Problems (*)(const Cell&)>(&check), py::arg("cell"));
  m.def("check", static_cast<Problems (*)(const Recording&)>(&check), py::arg("recording"));
  m.def("find_documents", &find_documents, py::arg("path"),
        "The cell files and recording.yaml files that check looks at.");
}
