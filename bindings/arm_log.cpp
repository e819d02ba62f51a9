// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/best_arm.hpp>
#include <kr5/arm_log/column_words.hpp>
#include <kr5/arm_log/compare_recordings.hpp>
#include <kr5/arm_log/comparison_text.hpp>
#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/arm_log/joint_unit.hpp>
#include <kr5/arm_log/log_problem.hpp>
#include <kr5/arm_log/measured_positions.hpp>
#include <kr5/arm_log/model_parts.hpp>
#include <kr5/arm_log/motion_split.hpp>
#include <kr5/arm_log/read_log.hpp>
#include <kr5/arm_log/servo_fit.hpp>
#include <kr5/arm_log/time_unit.hpp>
#include <kr5/arm_log/torque_constants.hpp>
#include <kr5/arm_log/two_publishers.hpp>

#include "interruptible.hpp"
#include "progress.hpp"
#include "recording_source.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::arm_log;
using kr5::cell::Cell;
using kr5::cell::Recording;
using kr5::gap::DiagnoseOptions;
using kr5::python::bind_enum;
using kr5::python::bind_struct;
using kr5::python::compute_interruptibly;
using kr5::python::fraction_of;
using kr5::python::recording_from;
using kr5::python::RecordingSource;
using kr5::python::shared_progress;
using kr5::python::simulator_from;

namespace {

void bind_log(py::module_& m) {
  bind_struct<ArmLog>(m, "ArmLog", "What the controller of an arm logged of a motion, in SI, a row an instant.")
      .def("validate", &ArmLog::validate, py::arg("joints"),
           "Raises InvalidArgument naming field, row and joint, for a model with so many joints.");
  bind_struct<LogColumns>(m, "LogColumns", "Names of the columns of a log, one a joint in the order of the model.");
  m.def("find_columns", &find_columns, py::arg("names"), py::arg("cell"), py::arg("given") = LogColumns{},
        "Columns of a table by the names of the joints of a model, or by numbers (q1, effort_1, position[0]).");
  m.def("read_log", &read_log, py::arg("file"), py::arg("cell"), py::arg("columns") = LogColumns{},
        "Log in a file of comma-separated numbers under one header line; kr5.logs reads more forms. Raises IoError or "
        "InvalidArgument naming file, line or column.");
  bind_enum<TimeUnit>(m, "TimeUnit", "Unit of the time stamps of a log.");
  m.attr("usual_row_step") = usual_row_step;  // between rows of a controller's log [s]
  m.def("guess_time_unit", &guess_time_unit, py::arg("stamps"), py::arg("usual_step") = usual_row_step,
        "Unit of time stamps of which nothing tells it; usual_step: between rows of such logs, 0: not known [s].");
  m.def("counts_rows", &counts_rows, py::arg("stamps"),
        "Whether stamps count rows, each one above the last, so that they tell no time.");
  bind_enum<JointUnit>(m, "JointUnit", "Unit of logged joint angles of which nothing tells it.");
  bind_struct<JointUnitGuess>(m, "JointUnitGuess", "Unit of logged joint angles by their numbers.");
  m.attr("MAX_RADIANS") = max_radians;
  m.def("guess_joint_unit", &guess_joint_unit, py::arg("values"), py::arg("lower"), py::arg("upper"),
        "Unit of logged angles, rows x joints that turn; lower, upper: limits of these joints [rad], may be empty.");
  m.def("magnitudes_only", &magnitudes_only, py::arg("loads"),
        "Whether loads, rows x joints, are sizes without a sign.");
  m.def("written_in_turn", &written_in_turn, py::arg("positions"),
        "Whether positions of a joint jump to and fro, as those of two publishers do.");
  bind_enum<LogNoteKind>(m, "LogNoteKind", "What a note on a log tells.");
  bind_struct<LogNote>(m, "LogNote", "What was taken of a log, or added to its model.")
      .def(
          "text", [](const LogNote& note, const Cell& cell) { return text(note, cell); }, py::arg("cell"),
          "Sentence without full stop; the cell names joints and units.");
}

/// What names of columns tell.
void bind_column_words(py::module_& m) {
  bind_enum<ColumnWord>(m, "ColumnWord", "What a word of the name of a column tells.");
  bind_enum<ColumnFamily>(m, "ColumnFamily", "Quantity of all joints: none | q | qc | qd | tau | i.");
  m.def("meaning_of", &meaning_of, py::arg("word"), "What a word of a name, in small letters, tells.");
  m.def("words_of", &words_of, py::arg("name"),
        "Words of a name in small letters, run-together commands as one (qcmd is qc); # and % are words.");
  m.def("family_of", &family_of, py::arg("stem"),
        "Quantity of a name in which # stands for the joint: its field says it, and the topic that publishes it only "
        "where the field does not.");
  m.def("on_motor_side", &on_motor_side, py::arg("stem"),
        "Whether angles or torques of a stem are those of motors, not of joints.");
  m.def("unit_in", &unit_in, py::arg("stem"), "Unit that a word of a stem states, also %; empty without one.");
  m.def("names_gripper", &names_gripper, py::arg("name"),
        "Whether a name is that of what grasps, which is no joint of the arm.");
  m.def("names_time", &names_time, py::arg("name"), "Whether the name of a column is that of a time.");
  m.def("time_unit_in", &time_unit_in, py::arg("name"),
        "Unit of time that a name ends in (time_ms, t [ns]): s | ms | us | ns; empty without one.");
}

void bind_motions(py::module_& m) {
  bind_struct<TimeSpan>(m, "TimeSpan", "Span of time.");
  bind_struct<Smoothing>(m, "Smoothing", "How measured positions are smoothed and thinned.");
  bind_struct<Positions>(m, "Positions", "Positions over times of their own.");
  m.def("choose_smoothing", &choose_smoothing, py::arg("t"), py::arg("q"), py::arg("loads") = Eigen::MatrixXd(),
        "Smoothing of a motion: five times its bandwidth; loads, in the same rows, for the meaning of uneven stamps.");
  m.def("middle_step", &middle_step, py::arg("t"),
        "Step of a log [s]: the median of its steps, of an even number the larger one in the middle.");
  m.def("smooth_positions", &smooth_positions, py::arg("t"), py::arg("q"), py::arg("smoothing"),
        "Positions at even steps, low-passed without delay.");
  m.def("positions_at", &positions_at, py::arg("positions"), py::arg("t"),
        "Positions at other times, by the cubic spline through them.");
  m.def("kept_rows", &kept_rows, py::arg("t"), py::arg("smoothing"), py::arg("experiment"), py::arg("positions"),
        py::arg("most") = 0, "Rows, from 0, that an experiment keeps of a log; most: limit of their number, 0: none.");
  m.attr("MOST_ROWS") = max_experiment_rows;
  m.attr("SMOOTHING_MARGIN") = smoothing_margin;
  m.def(
      "settle_time", &settle_time, py::arg("cell"), py::arg("q"),
      "Time after which the servos of a cell have forgotten how a motion that starts at q [rad or m] began; 0 without "
      "servos of the joints [s].");
  bind_struct<LoggedMotion>(m, "LoggedMotion", "Logged motion, as far as its split depends on it.");
  bind_enum<CutReason>(m, "CutReason", "Why a log was cut where it was.");
  bind_struct<MotionSpan>(m, "MotionSpan", "Experiment of a log.");
  m.def("split_motions", &split_motions, py::arg("logs"),
        "Experiments of logged motions: whole runs where there are several, else a log cut at rest or at 70 % of its "
        "motion.");
  m.def("rests", &rests, py::arg("t"), py::arg("q"), "Spans in which all joints stand; q: rows x joints [rad or m].");
  m.def("joints_move", &joints_move, py::arg("q"),
        "Whether any joint goes further than its noise; q: rows x joints [rad or m].");
  m.def(
      "parts_without_gap",
      [](const Eigen::VectorXd& t, double max_gap) {
        std::vector<std::pair<Eigen::Index, Eigen::Index>> out;
        for (const auto& part : parts_without_gap(t, max_gap)) out.emplace_back(part.first, part.last);
        return out;
      },
      py::arg("t"), py::arg("max_gap") = 0.0,
      "First row and row after the last of the parts between gaps of a clock; max_gap: 0: five median steps, 10 ms at "
      "least [s].");
}

void bind_checks(py::module_& m) {
  bind_struct<JointReading>(m, "JointReading", "How the columns of a log are those of the joints of a model.");
  bind_enum<LogProblemKind>(m, "LogProblemKind", "What is wrong with columns of a log.");
  bind_enum<LogRemedy>(m, "LogRemedy", "How the numbers of a log would make sense.");
  bind_struct<LogProblem>(m, "LogProblem", "What speaks against columns of a log as they were read.")
      .def("columns_text", &columns_text, "Columns that it speaks of, in words.")
      .def("found_text", &found_text, py::arg("cell"), "What was found, in words.")
      .def("expected_text", &expected_text, py::arg("cell"), "What was expected, in words.")
      .def("remedy_text", &remedy_text, py::arg("cell"), "What helps, in words.")
      .def(
          "text", [](const LogProblem& problem, const Cell& cell) { return text(problem, cell); }, py::arg("cell"),
          "Experiment, columns, found, expected and remedy in a sentence.");
  m.def("mismatch_text", &mismatch_text, "What is to be said of a log with problems as a whole.");
  m.def("require_masses", &require_masses, py::arg("model"),
        "Raises InvalidArgument for a model without masses of its links, from which torques follow.");
  m.def("check_positions", &check_positions, py::arg("cell"), py::arg("experiment"),
        "What speaks against the positions and the clock of an experiment: list of LogProblem.");
  m.def("check_loads", &check_loads, py::arg("cell"), py::arg("experiment"),
        "What speaks against the loads of a motion whose positions are right: list of LogProblem.");
  m.def("fitting_order", &fitting_order, py::arg("cell"), py::arg("experiment"),
        "Joint, from 0, of each column with which the loads of a motion fit; None where that of the columns does.");
  m.def(
      "fitting_convention", &fitting_convention, py::arg("cell"), py::arg("experiment"),
      "Directions and zeros of the joints with which the loads of a motion fit far better; None where there are none.");
  m.def("load_likeness", &load_likeness, py::arg("cell"), py::arg("experiment"),
        "Mean correlation of the loads of the joints with their simulation.");
  m.def("lever_arms", &lever_arms, py::arg("cell"), py::arg("q"),
        "Distance of the centre of what each joint carries from its axis [m].");
  m.attr("BETTER_LIKENESS") = better_likeness;
}

void bind_model(py::module_& m) {
  m.def(
      "with_parts_to_try",
      [](const Cell& cell) {
        Cell out = cell;
        auto notes = add_parts_to_try(out);
        return std::pair(out, notes);
      },
      py::arg("cell"), "Cell with drives and tool where its description has none, and notes of what was added.");
  m.def("described_cell", &described_cell, py::arg("description"), py::arg("recorded"),
        py::arg("states_rotors") = false,
        "Robot of a description in the cell of a recording. Raises InvalidArgument where it is another robot.");
  bind_struct<TorqueConstants>(m, "TorqueConstants", "Torque constants from a log of currents, on the joint side.")
      .def_property_readonly("first_unknown", &TorqueConstants::first_unknown,
                             "First joint, from 0, whose constant the log does not tell; -1: none.");
  m.def("estimate_torque_constants", &estimate_torque_constants, py::arg("recording"),
        "Torque constants by the currents that the torques of the model take; empty without currents.");
  m.def("lacks_torque_constants", &lacks_torque_constants, py::arg("cell"),
        "Whether the torque constants of a cell are all 1, as of a description, which states none.");
  m.def("noise_of_readings", &noise_of_readings, py::arg("parts"),
        "Standard deviation of one reading by third differences of uninterrupted parts.");
  m.def(
      "with_reading_noise",
      [](const Recording& recording, const Readings& readings) {
        Recording out = recording;
        auto notes = add_reading_noise(out, readings);
        return std::pair(out.cell, notes);
      },
      py::arg("recording"), py::arg("readings") = Readings{},
      "Cell of a recording with the noise of columns for which it states none, and notes of it. readings: "
      "uninterrupted "
      "parts of columns whose neighbours stand nearer in time than the rows of the recording.");
  m.def(
      "completed_model",
      [](const Recording& recording, const Readings& readings, bool constants_stated) {
        Recording out = recording;
        auto notes = complete_model(out, readings, constants_stated);
        return std::pair(out.cell, notes);
      },
      py::arg("recording"), py::arg("readings") = Readings{}, py::arg("constants_stated") = false,
      "Cell of a recording with the torque constants and the noise that its motions tell, and notes of it. Raises "
      "InvalidArgument naming a joint whose torque constant they do not tell.");
}

void bind_best_arm(py::module_& m) {
  bind_struct<BestArmErrors>(m, "BestArmErrors", "How far the best rigid arm with friction stays off the loads.")
      .def("notes", &notes_of, py::arg("recording"), "What a person should know of these errors: list of LogNote.");
  m.def("best_arm_errors", &best_arm_errors, py::arg("recording"), py::call_guard<py::gil_scoped_release>(),
        "Errors of the best rigid arm with friction in the motions to fit, on measured positions, at the delay of the "
        "greatest likelihood.");
  m.def("widened_search", &widened_search, py::arg("options"), py::arg("errors"), py::arg("joints"),
        "Options of a diagnosis for the log of a real arm; what differs from the defaults stays.");
}

void bind_servo_fit(py::module_& m) {
  m.def("servo_effects", &servo_effects, "Ids of the effects that identify_servos fits.");
  m.def("moves_by_torque_servos", &moves_by_torque_servos, py::arg("recording"),
        "Whether the motions of a recording are commands to torque servos with measured positions beside them.");
  m.def(
      "identify_servos",
      [](const RecordingSource& recording, int threads, const py::object& progress) {
        const ServoFitOptions options{
            .trust = false, .threads = threads, .progress = fraction_of(shared_progress(progress))};
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(py::none()),
                                     [&](const kr5::cell::Simulator&) { return identify_servos(*source, options); });
      },
      py::arg("recording"), py::arg("threads") = 0, py::arg("progress") = py::none(),
      "Servos, dry friction and inertias of all joints by forward simulation of the commands of a recording: "
      "kr5.gap.JointFit. Values of its cell are no more than where a search begins. progress: as of kr5.gap.diagnose. "
      "Raises InvalidArgument unless the recording moves by torque servos, which its cell states.");
}

void bind_diagnosis(py::module_& m) {
  py::class_<LogDiagnosis>(m, "LogDiagnosis", "Diagnosis of a log, and what it was made of.")
      .def_readonly("diagnosis", &LogDiagnosis::diagnosis, "Diagnosis of the disagreement of model and arm.")
      .def_readonly("recording", &LogDiagnosis::recording,
                    "Experiments of the log, with the model and what the log tells of it as cell.")
      .def_readonly("best_arm", &LogDiagnosis::best_arm, "Errors of the best rigid arm with friction.")
      .def_readonly("notes", &LogDiagnosis::notes, "What was taken of the log or added to the model.")
      .def_readonly("problems", &LogDiagnosis::problems, "What speaks against the log, where it was trusted.")
      .def("__repr__", [](const LogDiagnosis& d) {
        return "LogDiagnosis(" + std::string(kr5::name_of(d.diagnosis.verdict)) + ")";
      });
  m.def(
      "diagnose_log",
      [](const ArmLog& log, const Cell& model, DiagnoseOptions options, bool constants_stated, bool trust,
         const py::object& simulator, const py::object& progress) {
        options.progress = shared_progress(progress);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return diagnose_log(log, model, {options, constants_stated, trust}, s);
        });
      },
      py::arg("log"), py::arg("model"), py::arg("options") = DiagnoseOptions{}, py::arg("constants_stated") = false,
      py::arg("trust") = false, py::arg("simulator") = py::none(), py::arg("progress") = py::none(),
      "Why a model and the arm of a log disagree.\n\n"
      "Parameters\n----------\n"
      "log : ArmLog\n"
      "model : kr5.cell.Cell\n"
      "options : kr5.gap.DiagnoseOptions, optional\n    What stands at its default is set for the log of a real arm.\n"
      "constants_stated : bool\n    Whether torque constants hold although they are all 1; otherwise such are "
      "estimated.\n"
      "trust : bool\n    Whether numbers that are implausible are compared nevertheless.\n"
      "simulator, progress : as of kr5.gap.diagnose, optional\n\n"
      "Returns\n-------\nLogDiagnosis\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    A log that does not suffice or does not fit the model.");
  m.def(
      "diagnose",
      [](const RecordingSource& recording, const py::object& simulator, DiagnoseOptions options,
         const py::object& progress) {
        options.progress = shared_progress(progress);
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return kr5::arm_log::diagnose(*source, s, options);
        });
      },
      py::arg("recording"), py::arg("simulator") = py::none(), py::arg("options") = DiagnoseOptions{},
      py::arg("progress") = py::none(),
      "Diagnosis of a gap: where it lies, which effects cause it, how far they reduce it, and what remains "
      "unexplained. For the log of a real arm (motions on measured positions) with the errors of the best arm, and a "
      "search as wide as it needs; for motions by torque servos from what identify_servos finds, where the model is "
      "far off.\n\n"
      "Parameters\n----------\n"
      "recording : kr5.cell.Recording, or the folder of one\n"
      "simulator : one of kr5, or any object with predict(cell, experiment), optional\n"
      "    By default kr5.predict.FastSimulator(). predict returns the predicted columns (a kr5.io.Table or a dict of\n"
      "    arrays, units of kr5.cell.columns), a value for each row of the experiment.\n"
      "options : kr5.gap.DiagnoseOptions, optional\n"
      "progress : callable, optional\n"
      "    progress(stage, fraction) is called from time to time, from any thread, with the present stage (a text) "
      "and\n"
      "    the completed fraction of the whole.\n\n"
      "Returns\n-------\nkr5.gap.Diagnosis\n\n"
      "Raises\n------\nkr5.IoError\n    No recording stands in the folder, or it has errors in form.");
}

void bind_comparison(py::module_& m) {
  bind_struct<ParameterChange>(m, "ParameterChange", "Parameter of an effect in both of two recordings.");
  bind_struct<EffectChange, kr5::gap::EffectName>(m, "EffectChange", "Effect that differs between two recordings.")
      .def("text", &change_text, "Sentence with its values in both recordings.");
  py::class_<RecordingComparison>(m, "RecordingComparison", "What differs between two recordings of one model.")
      .def_readonly("first", &RecordingComparison::first, "Diagnosis of the first recording against its model.")
      .def_readonly("difference", &RecordingComparison::difference,
                    "Diagnosis of the second recording against the first; where reversed, of the first against the "
                    "second.")
      .def_readonly("reversed", &RecordingComparison::reversed,
                    "Whether the difference was explained only from the second recording to the first.")
      .def_readonly("by_arm", &RecordingComparison::by_arm,
                    "Whether the freely fitted arm of one recording was the reference of the other.")
      .def_readonly("changes", &RecordingComparison::changes, "Effects that differ, most probable first.")
      .def_readonly("common", &RecordingComparison::common, "Causes of the first recording that did not change.")
      .def_readonly("gap_with_model", &RecordingComparison::gap_with_model,
                    "Gap of the second recording at the model [-].")
      .def_readonly("gap_with_first", &RecordingComparison::gap_with_first,
                    "Gap of the second recording with the causes of the first in the model [-].")
      .def_property_readonly(
          "text", [](const RecordingComparison& c) { return text(c); }, "The comparison in sentences.")
      .def("__repr__", [](const RecordingComparison& c) { return "RecordingComparison('" + text(c) + "')"; });
  m.def(
      "compare_recordings",
      [](const RecordingSource& first, const RecordingSource& second, const py::object& simulator,
         DiagnoseOptions options, const py::object& progress) {
        options.progress = shared_progress(progress);
        const auto a = recording_from(first), b = recording_from(second);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return compare_recordings(*a, *b, s, options);
        });
      },
      py::arg("first"), py::arg("second"), py::arg("simulator") = py::none(), py::arg("options") = DiagnoseOptions{},
      py::arg("progress") = py::none(),
      "What differs between two recordings of one model. Errors of the model that both have are not told as a change: "
      "of motions on measured positions the freely fitted arm of the first recording is the reference.\n\n"
      "Parameters\n----------\n"
      "first, second : kr5.cell.Recording, or the folder of one\n"
      "simulator, options, progress : as of diagnose, optional\n\n"
      "Returns\n-------\nRecordingComparison\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    The robots differ.");
}

}  // namespace

void bind_arm_log(py::module_& m) {
  m.doc() = "From the log of a real arm and its model to a diagnosis.";
  bind_log(m);
  bind_column_words(m);
  bind_motions(m);
  bind_checks(m);
  bind_model(m);
  bind_best_arm(m);
  bind_servo_fit(m);
  bind_diagnosis(m);
  bind_comparison(m);
}
