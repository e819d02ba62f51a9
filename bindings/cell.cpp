// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/arm_links.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/cell/check.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/cell/effect_registry.hpp>
#include <kr5/cell/export_urdf.hpp>
#include <kr5/cell/import_urdf.hpp>
#include <kr5/cell/placed_object.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/cell/sensor_model.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/cell/update_urdf.hpp>

#include "column_conversion.hpp"
#include "effect_conversion.hpp"
#include "python_simulator.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::cell;
using kr5::python::bind_enum;
using kr5::python::bind_struct;
using kr5::python::values_of;
namespace fs = std::filesystem;

static void bind_parts(py::module_& m) {
  m.attr("Link") = py::type::of<Link>();
  bind_struct<Limits>(m, "Limits", "Limits of the joints.");
  bind_struct<Gears>(m, "Gears", "Gears between motors and links.");
  bind_struct<Robot>(m, "Robot", "Robot arm.").def_property_readonly("joints", &Robot::joints, "Number of joints.");
  bind_struct<Friction>(m, "Friction", "Friction on the joint side.");
  bind_struct<Drives>(m, "Drives", "Motors and gears.");
  bind_struct<SecondOrder>(
      m, "SecondOrder", "Second-order servo: x'' = wn^2 (u - x) - 2 xi wn x', where u is the command `delay` earlier.");
  bind_enum<CommandHold>(m, "CommandHold", "Command between its stamps.");
  bind_struct<TorqueServo>(m, "TorqueServo", "Servo that turns the error of a joint into a torque.");
  bind_enum<CorrectionMode>(m, "CorrectionMode", "Reference of a path correction.");
  bind_struct<Correction>(m, "Correction", "Path correction of a controller.");
  bind_struct<Servo>(m, "Servo", "Servo of the axes and of the path correction.")
      .def("of_joint", &Servo::of_joint, py::arg("index"), "Servo of a joint, counted from 0.")
      .def("torque_of", &Servo::torque_of, py::arg("index"), "Torque servo of a joint, counted from 0.");
  bind_struct<Tool>(m, "Tool", "Tool on the flange.").def("inertia_matrix", &Tool::inertia_matrix, "3x3 [kg m^2].");
  bind_struct<Peg>(m, "Peg", "Peg that is inserted.");
  bind_struct<Tube>(m, "Tube", "Tube that receives the peg.");
  bind_struct<Contact>(m, "Contact", "Contact of the tool with its surroundings.");
  bind_struct<Distortion>(m, "Distortion", "Lens distortion.");
  bind_struct<Camera>(m, "Camera", "Camera.")
      .def("pinhole", &Camera::pinhole, "Intrinsics as kr5.Pinhole.")
      .def("set_pinhole", &Camera::set_pinhole, py::arg("lens"),
           "Image size and intrinsics of a kr5.Pinhole; the lens model stays where it holds the coefficients, else the "
           "least that does is taken.");
  bind_struct<Target, kr5::Target>(m, "Target", "Target of the cell with its pose.");
  bind_struct<PlacedObject, kr5::Solid>(m, "PlacedObject", "Solid in the cell.");
  bind_struct<Board>(m, "Board", "Marker board.").def("target", &Board::target, "Board as a general target.");
  bind_struct<ScannerTarget>(m, "ScannerTarget", "Object measured by the line scanner.");
  bind_struct<LineScanner>(m, "LineScanner", "Line scanner.");
  bind_struct<Noise>(m, "Noise", "Standard deviation of one reading of each sensor.")
      .def("of", &Noise::of, py::arg("key"), py::arg("joint") = -1,
           "Standard deviation of a column by its key; of a joint, from 0, where it has one of its own.");
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
  bind_enum<EffectTarget>(m, "EffectTarget", "Target of an effect.");
  bind_enum<EffectValueKind>(m, "EffectValueKind", "Form of a parameter.");
  bind_enum<CoordinateKind>(m, "CoordinateKind", "Relation of a parameter to the coordinates of a search.");
  bind_struct<EffectParameter>(m, "EffectParameter", "Parameter of an effect, with unit, off value and bounds.")
      .def_property_readonly(
          "measures_size", &EffectParameter::measures_size,
          "Whether the parameter alone determines the size of the effect; a time constant does not.");
  bind_struct<Effect>(m, "Effect", "Row of the catalogue: everything about an effect except its law.")
      .def_property_readonly("periodic", &Effect::periodic,
                             "Whether the effect is periodic in the angle of its joint.");
  py::class_<Effects>(m, "Effects",
                      "Active effects of a cell, beyond its nominal model: {effect: {target: {parameter: value}}}.")
      .def(py::init(
               [](const py::dict& effects) { return kr5::python::Convert<Effects>::from_python(effects, "effects"); }),
           py::arg("effects") = py::dict(), "Raises InvalidArgument for an unknown effect, target or parameter.")
      .def(
          "get",
          [](const Effects& self, const std::string& effect, const std::string& target, const std::string& parameter) {
            return kr5::python::effect_value(get_effect(self, effect, target, parameter),
                                             kr5::python::kind_of(find_effect(effect), parameter));
          },
          py::arg("effect"), py::arg("target"), py::arg("parameter"),
          "Value; None when it is off and replaces a value of the cell.")
      .def("to_dict", &kr5::python::Convert<Effects>::to_plain, "Nested dict of the active effects.")
      .def("__repr__",
           [](const Effects& self) {
             return "Effects(" + py::repr(kr5::python::Convert<Effects>::to_plain(self)).cast<std::string>() + ")";
           })
      .def(
          "__len__", [](const Effects& self) { return active_effects(self).size(); }, "Number of active effects.");
  m.def("effect_catalogue", &effect_catalogue, "Every effect of the catalogue.");
  m.def("register_effect", &register_from_python, py::arg("effect"), py::kw_only(), py::arg("change_cell") = py::none(),
        py::arg("change_columns") = py::none(),
        "Adds a custom effect with its law to the catalogue: it can be used in cell files, and is checked, simulated, "
        "diagnosed and explained like any other.\n\n"
        "change_cell(cell, target, values) -> cell: sets the effect in the simulated cell (a copy, which may be "
        "changed in place; None means that it was). change_columns(columns, experiment, target, values) -> dict: "
        "changes what the "
        "simulator predicts, a dict of arrays with one value for each row of the experiment. values: dict of the "
        "parameters. One of the two is required. Both are called often, from any thread, one call at a time. Raises "
        "InvalidArgument for an id that is already in the catalogue, or for an incomplete row.");
  m.def("unregister_effect", &unregister_effect, py::arg("id"),
        "Removes a registered effect from the catalogue. Raises InvalidArgument for a built-in one.");
  m.def("find_effect", &find_effect, py::arg("id"),
        "Row of an effect. Raises InvalidArgument, with the nearest id, for an unknown one.");
}

static void bind_cell_itself(py::module_& m) {
  bind_struct<Cell>(m, "Cell", "Nominal model of a robot cell with its active effects (kr5-cell/1).")
      .def_property_readonly("has_torque_servos", &Cell::has_torque_servos,
                             "Whether its joints have torque servos, so that commands move it forward.")
      .def(
          "flange", [](const Cell& self, const Eigen::VectorXd& q) { return nominal_chain(self).flange(q); },
          py::arg("q"), "T_base_flange of the nominal arm for joint values q [rad or m].")
      .def(
          "link_poses", [](const Cell& self, const Eigen::VectorXd& q) { return nominal_chain(self).link_poses(q); },
          py::arg("q"), "Poses of the link frames 1..n in B for joint values q [rad or m].")
      .def("T_base_tool", &T_base_tool, py::arg("q"), "Nominal tool tip in the base for joint values q [rad or m].")
      .def("T_flange_camera", &T_flange_camera, "Nominal camera in the flange, or None.")
      .def("T_flange_scanner", &T_flange_scanner, "Nominal scanner in the flange, or None.")
      .def("nominal_chain", &nominal_chain, "Nominal arm.")
      .def("sensor_model", &sensor_model,
           "What turns the sensors of the cell into readings of its robot, as a controller believes it.")
      .def(
          "effect_targets",
          [](const Cell& self, const std::string& effect) { return effect_targets(find_effect(effect), self); },
          py::arg("effect"), "Names of the targets of an effect in this cell.")
      .def(
          "nominal_value",
          [](const Cell& self, const std::string& effect, const std::string& target, const std::string& parameter,
             int choice) {
            return kr5::python::effect_value(nominal_value(self, effect, target, parameter, choice),
                                             kr5::python::kind_of(find_effect(effect), parameter));
          },
          py::arg("effect"), py::arg("target"), py::arg("parameter"), py::arg("choice") = 0,
          "Value of the cell that a parameter of an effect replaces; None for an addition. choice: value of the "
          "effect's discrete parameter, such as the source of crosstalk. Raises InvalidArgument naming the valid ones.")
      .def(
          "set_effect",
          [](Cell& self, const std::string& effect, const std::string& target, const std::string& parameter,
             const py::object& value) {
            set_effect(self, effect, target, parameter, kr5::python::effect_value(value));
          },
          py::arg("effect"), py::arg("target"), py::arg("parameter"), py::arg("value"),
          "Sets one parameter; None switches it off. Raises InvalidArgument naming the valid ones.")
      .def("to_yaml", static_cast<std::string (*)(const Cell&)>(&to_yaml),
           "Text of the file, in the form in which it was read.");
  m.def("load_cell", &load_cell, py::arg("file"),
        "Reads a cell file in any of its forms. Raises IoError with file, line and field of every error in "
        "form.");
  m.def("parse_cell", &parse_cell, py::arg("yaml"), py::arg("source") = "text", "Reads a cell from a text.");
  m.def("save_cell", &save_cell, py::arg("cell"), py::arg("file"),
        "Writes a cell in the form in which it was read; numbers read back exactly.");
}

static void bind_columns(py::module_& m) {
  bind_enum<Kind>(m, "Kind", "Kind of an experiment.");
  bind_enum<Role>(m, "Role", "Role of a column: given | predicted.");
  bind_enum<Split>(m, "Split", "Use of the data: fit | check.");
  bind_enum<JointReference>(m, "JointReference", "Values in qc of a motion: commanded | measured.");
  bind_struct<Column>(m, "Column", "Column of a kind of experiment.");
  m.def("columns", &columns, py::arg("kind"), py::arg("joints"), "Columns of a kind for this number of joints.");
  m.def("compared_columns", &compared_columns, py::arg("kind"), py::arg("joints"),
        "Columns in which a recording and a simulation are compared: the predicted ones with noise; an orientation as "
        "rx ry rz [rad].");
  m.def(
      "find_column", [](Kind kind, const std::string& name) { return find_column(kind, name); }, py::arg("kind"),
      py::arg("name"), "Column of a kind by its name, also rx ry rz. Raises InvalidArgument for an unknown one.");
  m.def("run_column", &run_column, py::arg("kind"),
        "Column whose values keep a file's runs apart (`run`, `view`, ...); empty for a motion, which has one.");
}

static void bind_recording(py::module_& m) {
  bind_struct<Experiment>(m, "Experiment", "Experiment: one file of a recording.")
      .def_property(
          "data", [](const Experiment& e) { return e.data; },
          [](Experiment& e, const kr5::io::Table& t) { e.data = t; }, "Table of the experiment (a copy).")
      .def_property(
          "lead_in", [](const Experiment& e) { return e.lead_in; },
          [](Experiment& e, const kr5::io::Table& t) { e.lead_in = t; },
          "Rows before data that are simulated and not compared, because the motion does not begin at rest (a copy).")
      .def(
          "__getitem__", [](const Experiment& e, const std::string& name) { return e.data.column(name); },
          py::arg("column"), "One column as an array.");
  m.def("split_lead_in", &split_lead_in, py::arg("experiment"), py::arg("duration"),
        "Experiment with the rows of its first `duration` seconds as lead-in. Raises InvalidArgument when no row is "
        "left.");
  m.def("with_lead_in", &with_lead_in, py::arg("experiment"), "Experiment with its lead-in as part of the data.");
  m.def(
      "initial_speed",
      [](const Eigen::VectorXd& t, const Eigen::VectorXd& q) {
        const InitialSpeed found = initial_speed(t, q);
        return std::pair(found.value, found.noise_gain);
      },
      py::arg("t"), py::arg("q"),
      "Speed of a joint [rad/s or m/s] when its readings begin, and its standard deviation over that of one reading "
      "[1/s], by a parabola through as few of the first readings as their noise allows. t: n times [s]; q: n "
      "positions [rad or m].");
  py::class_<Recording>(m, "Recording", "Commands and sensor readings of a cell (kr5-recording/1).")
      .def(py::init([](Cell cell, std::vector<Experiment> experiments) {
             Recording r;
             r.cell = std::move(cell);
             r.experiments = std::move(experiments);
             return r;
           }),
           py::arg("cell"), py::arg("experiments"))
      .def_property(
          "cell", [](const Recording& r) { return r.cell; }, [](Recording& r, const Cell& c) { r.cell = c; },
          "Nominal cell of the recording (a copy).")
      .def_property(
          "experiments", [](const Recording& r) { return r.experiments; },
          [](Recording& r, std::vector<Experiment> e) { r.experiments = std::move(e); },
          "Experiments of the recording (copies).")
      .def_property_readonly(
          "folder", [](const Recording& r) { return r.folder; }, "Folder from which the recording was read.")
      .def("__getitem__", &Recording::experiment, py::arg("name"), py::return_value_policy::copy, "Experiment by name.")
      .def("__repr__", [](const Recording& r) {
        return "Recording(" + r.cell.name + ", " + std::to_string(r.experiments.size()) + " experiments)";
      });
  m.def("load_recording", &load_recording, py::arg("folder"), py::call_guard<py::gil_scoped_release>(),
        "Reads a recording from its folder. Raises IoError with file, line and field of every error in form.");
  m.def("save_recording", &save_recording, py::arg("recording"), py::arg("folder"),
        py::call_guard<py::gil_scoped_release>(), "Writes a recording to a folder; numbers read back exactly.");
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
  py::class_<Simulator, PythonSimulator>(
      m, "Simulator",
      "Simulator: predicts the sensor readings of a cell in an experiment, without noise. A class that inherits it and "
      "has `predict` can be used as any other simulator.")
      .def(py::init<>())
      .def(
          "predict",
          [](const Simulator& self, const Cell& cell, const Experiment& experiment) {
            cell.validate();
            return self.predict(cell, experiment);
          },
          py::arg("cell"), py::arg("experiment"), py::call_guard<py::gil_scoped_release>(),
          "Table of the predicted columns, a row for each row of the experiment. Raises InvalidArgument naming the "
          "missing part of the cell or the missing given column.");
}

static void bind_urdf(py::module_& m) {
  py::class_<UrdfImport>(m, "UrdfImport", "Cell from a URDF.")
      .def_property_readonly(
          "cell", [](const UrdfImport& u) { return u.cell; }, "Cell (a copy).")
      .def_readonly("base", &UrdfImport::base, "Link that is used as the base B.")
      .def_readonly("tip", &UrdfImport::tip, "Link that is used as the tool tip E.")
      .def_readonly("joints", &UrdfImport::joints, "Names of the joints, from the base.")
      .def_readonly("notes", &UrdfImport::notes,
                    "Notes on what the cell cannot represent or the file does not contain.");
  m.def(
      "import_urdf",
      [](const fs::path& file, const std::string& base, const std::string& tip) {
        return import_urdf(file, {base, tip});
      },
      py::arg("file"), py::arg("base") = "", py::arg("tip") = "",
      "Serial arm between two links of a robot. Raises IoError, with the remedy, for a file without one.");
  m.def("to_urdf", &to_urdf, py::arg("cell"), "URDF of the arm and of the mass of its tool.");
  m.def("export_urdf", &export_urdf, py::arg("cell"), py::arg("file"), "Writes that URDF to a file.");
  py::class_<UrdfUpdate>(m, "UrdfUpdate", "URDF with a changed arm in it.")
      .def_readonly("xml", &UrdfUpdate::xml, "The document.")
      .def_readonly("changes", &UrdfUpdate::changes, "What changed, in words, in the order of the chain.");
  m.def(
      "update_urdf",
      [](const Cell& cell, const std::string& xml, const std::string& source, const std::string& base,
         const std::string& tip) {
        return update_urdf(xml, source, cell, {base, tip});
      },
      py::arg("cell"), py::arg("xml"), py::arg("source"), py::arg("base") = "", py::arg("tip") = "",
      "Arm of a cell, effects apart, written into the URDF that describes it, which keeps its names, meshes, limits "
      "and "
      "comments.\n\nxml: text of the document; source: its name in errors; base, tip: links, as at the import. Raises "
      "IoError for text that is no URDF, and for that of another robot.");
}

static void bind_arm_links(py::module_& m) {
  bind_struct<ArmLink>(m, "ArmLink", "Link of a serial arm, with the joint that moves it.");
  bind_struct<ArmLinks>(m, "ArmLinks", "Serial arm as links whose frames lie on the axes of their joints.");
  m.def("arm_links", &arm_links, py::arg("cell"),
        "Arm of a cell, effects and tool apart, as descriptions of robots have it; the tip is the flange.");
  m.def("link_displacements", &link_displacements, py::arg("before"), py::arg("after"),
        "How each link has been displaced when an arm has become another, 4x4 in the base, every joint value zero [m]. "
        "Raises InvalidArgument for arms that differ too much to be one.");
  m.def(
      "arm_ends_before", &arm_ends_before, py::arg("joints"), py::arg("behind"),
      "Whether a chain that branches is an arm which ends there: what follows has no joints, as frames that are fixed "
      "to the flange, or fewer than the arm of at least four, as the fingers of a hand. behind: joints on the longest "
      "way from the branch to an end.");
  m.def("joints_without_range", &joints_without_range, py::arg("arm"),
        "Joints whose limits are no range: the lower one is not below the upper one, or one is beyond 50 rad or 20 m, "
        "which exporters write where they know none.");
  m.def("cell_of_links", &cell_of_links, py::arg("arm"),
        "Cell with an arm: Denavit-Hartenberg rows, masses, limits and names; a tool without mass when the tip lies "
        "beside the last joint axis; drives of unit gear (a current is a joint torque) when a joint has friction or a "
        "rotor. Raises InvalidArgument when there is no link.");
}

void bind_cell(py::module_& m) {
  m.doc() = "Description of a robot cell and of its recordings.";
  bind_parts(m);
  bind_effects(m);
  bind_cell_itself(m);
  bind_urdf(m);
  bind_arm_links(m);
  bind_columns(m);
  bind_recording(m);
  bind_simulator(m);
  using Problems = std::vector<kr5::io::Diagnostic>;
  m.def("check", static_cast<Problems (*)(const fs::path&)>(&check), py::arg("path"),
        py::call_guard<py::gil_scoped_release>(),
        "Errors and warnings of a cell file, a recording, or all of them below a folder.\n\n"
        "Returns\n-------\nlist of kr5.io.Diagnostic\n    Empty when there are no findings.");
  m.def("check", static_cast<Problems (*)(const Cell&)>(&check), py::arg("cell"));
  m.def("check", static_cast<Problems (*)(const Recording&)>(&check), py::arg("recording"));
  m.def("find_documents", &find_documents, py::arg("path"), "Cell files and recording.yaml files that check reads.");
}
