// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <optional>
#include <variant>

#include <kr5/gap/cause_evidence.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/effect_fit.hpp>
#include <kr5/gap/explanation.hpp>
#include <kr5/gap/explanation_text.hpp>
#include <kr5/gap/joint_fit.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/gap/model_warnings.hpp>
#include <kr5/gap/notes.hpp>
#include <kr5/gap/plan.hpp>
#include <kr5/gap/sentences.hpp>
#include <kr5/gap/words.hpp>

#include "column_conversion.hpp"
#include "interruptible.hpp"
#include "progress.hpp"
#include "python_simulator.hpp"
#include "recording_source.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::gap;
using kr5::python::bind_enum;
using kr5::python::bind_struct;
using kr5::python::call_python;
using kr5::python::compute_interruptibly;
using kr5::python::fraction_of;
using kr5::python::put_back_columns;
using kr5::python::recording_from;
using kr5::python::RecordingSource;
using kr5::python::Shared;
using kr5::python::shared_progress;
using kr5::python::simulator_from;

namespace {

/// "effect:target", as on the command line, or an EffectName.
using NameText = std::variant<EffectName, std::string>;
/// One effect alone, or several that act together.
using AlternativeText = std::variant<EffectName, std::string, std::vector<NameText>>;

EffectName effect_name(const NameText& given) {
  if (const auto* name = std::get_if<EffectName>(&given)) return *name;
  const std::string& text = std::get<std::string>(given);
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == text.size())
    throw kr5::InvalidArgument("found the effect '" + text +
                               "', expected effect:target, for instance coulomb_friction:joint3");
  return {text.substr(0, colon), text.substr(colon + 1)};
}

std::vector<EffectName> effect_names(const std::vector<NameText>& given) {
  std::vector<EffectName> out;
  for (const NameText& name : given) out.push_back(effect_name(name));
  return out;
}

std::vector<Alternative> alternatives_from(const std::vector<AlternativeText>& given) {
  std::vector<Alternative> out;
  for (const AlternativeText& alternative : given) {
    if (const auto* names = std::get_if<std::vector<NameText>>(&alternative))
      out.push_back(effect_names(*names));
    else if (const auto* text = std::get_if<std::string>(&alternative))
      out.push_back({effect_name(*text)});
    else
      out.push_back({std::get<EffectName>(alternative)});
  }
  return out;
}

Hypothesis make_hypothesis(const std::string& effect, const std::string& target,
                           const std::vector<OwnCoordinate>& coordinates, const py::object& apply,
                           const py::object& change, double inaccuracy) {
  OwnEffect own{{effect, target}, coordinates, {}, {}, inaccuracy};
  const std::string of = " of custom effect " + effect + " on " + target;
  if (!apply.is_none())
    own.apply = [function = Shared(apply), of](kr5::cell::Cell& cell, const Eigen::VectorXd& x) {
      call_python("apply" + of, [&] {
        const py::object copy = py::cast(cell), out = (*function)(copy, x);
        cell = kr5::python::cast_or_complain<kr5::cell::Cell>(out.is_none() ? copy : out, "apply" + of);
      });
    };
  if (!change.is_none())
    own.change = [function = Shared(change), of](kr5::io::Table& table, const kr5::cell::Experiment& experiment,
                                                 const Eigen::VectorXd& x) {
      call_python("change" + of, [&] {
        const py::dict columns = kr5::python::columns_to_dict(table);
        const py::object out = (*function)(columns, experiment, x);
        if (!out.is_none() && !py::isinstance<py::dict>(out))
          kr5::python::complain("change" + of, "a dict of columns, or None", out);
        put_back_columns(table, out.is_none() ? columns : py::reinterpret_borrow<py::dict>(out));
      });
    };
  return own_hypothesis(own);
}

void bind_hypotheses(py::module_& m) {
  bind_struct<OwnCoordinate>(m, "Coordinate", "Coordinate of a hypothesis; 0 is off.");
  py::class_<Hypothesis>(m, "Hypothesis",
                         "Hypothesis: a custom effect that competes with those of the catalogue.\n\n"
                         "apply(cell, x) -> cell: sets the effect in a cell (a copy, which may be changed in place and "
                         "returned; None means that it was changed). change(columns, experiment, x) -> dict: changes "
                         "the prediction, a dict of arrays with one value for each row of the experiment, for what a "
                         "cell cannot represent, such as a fault of a sensor. One of the two is required. x: array of "
                         "the coordinates in their units. Both are called often, from any thread, one call at a time; "
                         "an exception that they raise ends the diagnosis.")
      .def(py::init(&make_hypothesis), py::kw_only(), py::arg("effect"), py::arg("target"), py::arg("coordinates"),
           py::arg("apply") = py::none(), py::arg("change") = py::none(), py::arg("inaccuracy") = 0.0,
           "inaccuracy: assumed relative error of the simulated effect. Raises InvalidArgument naming the invalid "
           "argument.")
      .def_readonly("effect", &Hypothesis::effect, "Name of the effect in reports.")
      .def_readonly("target", &Hypothesis::target, "Target of the effect in reports.")
      .def("__repr__", [](const Hypothesis& h) { return "Hypothesis(" + h.effect + " on " + h.target + ")"; });
}

void bind_typical_effect(py::module_& m) {
  m.def(
      "with_typical_effect",
      [](const kr5::cell::Cell& cell, const std::string& effect, const std::string& target, double first_time,
         double last_time) {
        return with_typical_effect(cell, {effect, target}, {first_time, last_time});
      },
      py::arg("cell"), py::arg("effect"), py::arg("target"), py::arg("first_time") = 0.0, py::arg("last_time") = 1.0,
      "Cell with an effect of the catalogue added at a size that such an effect often has: the first of its discrete "
      "choices, and one cycle a turn where it is periodic. first_time, last_time: of the experiments, on which time "
      "constants depend [s]. Raises InvalidArgument for an unknown effect, and for a target that this cell does not "
      "have.");
}

/// Options with `own_hypotheses`, which no list of fields can hold.
template <class Options>
auto bind_options(py::module_& m, const char* name, const char* doc) {
  return bind_struct<Options>(m, name, doc)
      .def_property(
          "own_hypotheses", [](const Options& o) { return o.own_hypotheses; },
          [](Options& o, const std::vector<Hypothesis>& own) { o.own_hypotheses = own; },
          "Custom effects beside those of the catalogue: list of Hypothesis (a copy; assign the whole list).");
}

/// What a diagnosis says of a recording itself, and what it does not blame.
void bind_findings(py::module_& m) {
  bind_enum<LeftOutReason>(m, "LeftOutReason", "Why something recorded was not compared.");
  bind_enum<ScopeReason>(m, "ScopeReason", "Why a recording cannot show something.");
  bind_enum<NotBlamed>(m, "NotBlamed", "Why an effect that comes near is not blamed.");
  bind_enum<NotTried>(m, "NotTried", "Why an effect was not tried.");
  bind_struct<NoiseRatio>(m, "NoiseRatio", "Measured noise that differs from the declared one.");
  bind_struct<ClockFault>(m, "ClockFault", "Columns that were logged late or early.")
      .def_property_readonly("text", &fault_text, "The same as part of a sentence.")
      .def_property_readonly("columns", &clock_text, "Name of the columns in a sentence.");
  bind_struct<ColumnName>(m, "ColumnName", "Column of one experiment.");
  bind_struct<LeftOut>(m, "LeftOut", "What was recorded and not compared.")
      .def_property_readonly("text", &left_out_text, "The same as part of a sentence.");
  bind_struct<MissingSplit>(m, "MissingSplit", "Kind of experiment with none to fit, or none to check.");
  bind_struct<ScopeLimit>(m, "ScopeLimit", "Limit of what a recording can show.")
      .def_property_readonly("text", &limit_text, "The same as part of a sentence.");
  bind_struct<NearestEffect, EffectName>(m, "NearestEffect", "Effect that is not blamed, although it comes near.")
      .def_property_readonly(
          "text", [](const NearestEffect& e) { return reason_text(e); }, "Why it is not blamed, in words.");
  bind_struct<UntriedEffect>(m, "UntriedEffect", "Effect that this cell or recording cannot show.")
      .def_property_readonly(
          "text", [](const UntriedEffect& e) { return reason_text(e); }, "Why it was not tried, in words.");
  bind_struct<NextExperiment>(m, "NextExperiment", "Experiment that would distinguish tied effects.")
      .def_property_readonly("text", &experiment_text, "The same in words; empty where none is known.");
  bind_struct<Note>(m, "Note", "Sentence about a recording, and what it means.");
}

void bind_dependences(py::module_& m) {
  bind_enum<VariableKind>(m, "VariableKind", "Kind of a variable that a residual may depend on.");
  bind_enum<Shape>(m, "Shape", "How a residual depends on a variable.");
  bind_struct<EffectName>(m, "EffectName", "Effect and its target.");
  bind_struct<Variable>(m, "Variable", "What the cell was doing, as a number in each row.")
      .def_property_readonly("symbol", &symbol, "Short notation, e.g. q3, |qd3|, predicted i3.");
  bind_struct<Dependence>(m, "Dependence", "Tested dependence of a residual on what the cell was doing.");
}

/// Names of what a diagnosis speaks of.
void bind_words(py::module_& m) {
  m.def("kind_text", &kind_text, py::arg("kind"), "Kind of experiment in words.");
  m.def("column_text", &column_text, py::arg("group"), "Column such as motion.i3 in words.");
  m.def("variable_text", &variable_text, py::arg("variable"), py::arg("kind") = "",
        "Variable in words; kind: of the experiment whose column depends on it.");
  m.def("part_of", &part_of, py::arg("group"), "Part of the cell that a column such as motion.i3 belongs to.");
  m.def("part_text", &part_text, py::arg("part"), "Such a part in words.");
  m.def("target_text", &target_text, py::arg("target"), "Target of an effect in words.");
  m.def(
      "effect_text",
      [](const std::string& effect, const std::string& target) {
        return effect_text({effect, target});
      },
      py::arg("effect"), py::arg("target"), "Effect on its target in words.");
  m.def("effects_text", &effects_text, py::arg("effect"), py::arg("targets"), "Effect on several targets in words.");
  m.def("display_unit", &display_unit, py::arg("unit"), py::arg("values"), py::arg("target"),
        "Factor from SI, and unit, of values of an effect's parameter in a sentence.");
  m.def("value_text", &value_text, py::arg("parameter"), py::arg("target"),
        "Value of a parameter with uncertainty and unit; of a pose the uncertainty alone.");
  m.def("joint_name", &joint_name, py::arg("joint_names"), py::arg("target"),
        "Name of a joint in the description of the robot, where it says more than its number; else empty.");
  m.def("find_variable", &find_variable, py::arg("symbol"), "Variable of a short notation, e.g. |qd3|.");
}

/// The sentences of a diagnosis.
void bind_sentences(py::module_& m) {
  m.def("location_text", &location_text, py::arg("where"), "Where a gap is, as a sentence.");
  m.def("cause_text", &cause_text, py::arg("cause"), py::arg("joint_names") = std::vector<std::string>{},
        "Name, value and probability of a cause.");
  m.def("dependence_text", &dependence_text, py::arg("dependence"), py::arg("kind") = "",
        "Dependence as the end of `the gap ...`; kind: of the experiment.");
  m.def("notes", &notes, py::arg("diagnosis"), py::arg("noise_declared") = true,
        "Notes on a recording, beside late columns. noise_declared: whether the model declares the noise of its "
        "sensors.");
  m.def(
      "diagnosis_from_json", &diagnosis_from_json, py::arg("text"), py::arg("source") = "diagnosis",
      "Diagnosis of a JSON text of format kr5-gap/2, or kr5-gap/1, whose sentences are kept as notes; it has no cell. "
      "source names the text in errors. Raises IoError with line and field for what is no such text.");
}

void bind_diagnosis(py::module_& m) {
  bind_enum<Verdict>(m, "Verdict", "Verdict: no_gap | explained | partly_explained | unknown.");
  bind_dependences(m);
  bind_struct<ColumnExcess>(m, "ColumnExcess", "Gap of one column over all experiments of a kind.");
  bind_struct<ParameterEstimate>(m, "ParameterEstimate", "Estimated parameter, as in a cell file.");
  bind_struct<Cause, EffectName>(m, "Cause", "Cause: an effect that the diagnosis blames.");
  bind_struct<ColumnReduction>(m, "ColumnReduction", "Gap of a column before and after.");
  bind_struct<GapReduction>(m, "GapReduction", "Gap before and after.");
  bind_struct<ColumnError>(m, "ColumnError", "Known error of a simulator in one column.");
  bind_struct<ColumnCorrelation>(m, "ColumnCorrelation", "Noise of one column whose neighbouring rows are alike.");
  bind_findings(m);
  bind_struct<Diagnosis>(m, "Diagnosis", "Diagnosis of the disagreement of a simulation and a cell (kr5-gap/2).")
      .def("to_json", &to_json, "JSON text of format kr5-gap/2.")
      .def_property_readonly("text", &verdict_text, "The verdict in sentences.")
      .def_property_readonly("headline", &headline_text, "Beginning of the verdict, the cause first: 40 words at most.")
      .def_property_readonly("details", &details_text, "What the verdict says beyond its headline.")
      .def_property_readonly("warnings", &warnings, "All that was found about the recording, a sentence each.")
      .def_property_readonly(
          "cell", [](const Diagnosis& d) { return d.cell; }, "Nominal cell with the causes added (a copy).");
  bind_words(m);
  bind_sentences(m);
  bind_options<DiagnoseOptions>(m, "DiagnoseOptions", "Options of diagnose.")
      .def_property(
          "simulator_errors", [](const DiagnoseOptions& o) { return o.simulator_errors; },
          [](DiagnoseOptions& o, const std::vector<ColumnError>& errors) { o.simulator_errors = errors; },
          "Known errors of the simulator in single columns, beside simulator_floor for all; the greater counts: list "
          "of ColumnError (a copy; assign the whole list).")
      .def_property(
          "noise_correlations", [](const DiagnoseOptions& o) { return o.noise_correlations; },
          [](DiagnoseOptions& o, const std::vector<ColumnCorrelation>& all) { o.noise_correlations = all; },
          "Columns whose noise is alike in neighbouring rows, so that it is larger than these show: list of "
          "ColumnCorrelation (a copy; assign the whole list).")
      .def_readwrite("errors_of_recording", &DiagnoseOptions::errors_of_recording,
                     "Whether simulator_errors were estimated from the recording itself: a column that stays off by "
                     "more than twice its noise and a third of what it shows is then unexplained all the same.");
  m.def(
      "diagnose",
      [](const RecordingSource& recording, const py::object& simulator, DiagnoseOptions options,
         const py::object& progress) {
        options.progress = shared_progress(progress);
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator),
                                     [&](const kr5::cell::Simulator& s) { return diagnose(*source, s, options); });
      },
      py::arg("recording"), py::arg("simulator") = py::none(), py::arg("options") = DiagnoseOptions{},
      py::arg("progress") = py::none(),
      "Diagnosis of a gap: where it lies, which effects cause it, how far they reduce it, and what remains "
      "unexplained.\n\n"
      "Parameters\n----------\n"
      "recording : kr5.cell.Recording, or the folder of one\n"
      "simulator : one of kr5, or any object with predict(cell, experiment), optional\n"
      "    By default kr5.predict.FastSimulator(). predict returns the predicted columns (a kr5.io.Table or a dict of\n"
      "    arrays, units of kr5.cell.columns), a value for each row of the experiment.\n"
      "options : DiagnoseOptions, optional\n"
      "progress : callable, optional\n"
      "    progress(stage, fraction) is called from time to time, from any thread, with the present stage (a text) "
      "and\n"
      "    the completed fraction of the whole.\n\n"
      "Returns\n-------\nDiagnosis\n\n"
      "Raises\n------\nkr5.IoError\n    No recording stands in the folder, or it has errors in form.");
}

void bind_joint_fit(py::module_& m) {
  bind_struct<JointFitOptions>(m, "JointFitOptions", "Options of fit_joint_effects.");
  bind_struct<FittedEffect, EffectName>(m, "FittedEffect", "Effect on a target, fitted beside all others.");
  bind_struct<ColumnFit>(m, "ColumnFit", "How far the predictions of a column are off, in its unit.");
  bind_struct<JointFit>(m, "JointFit", "Effects of all joints, fitted together.")
      .def_property_readonly(
          "cell", [](const JointFit& f) { return f.cell; }, "Cell of the recording with the effects (a copy).");
  m.def(
      "fit_joint_effects",
      [](const RecordingSource& recording, const py::object& simulator, JointFitOptions options,
         const py::object& progress) {
        options.progress = fraction_of(shared_progress(progress));
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return fit_joint_effects(*source, s, options);
        });
      },
      py::arg("recording"), py::arg("simulator") = py::none(), py::arg("options") = JointFitOptions{},
      py::arg("progress") = py::none(),
      "Effects of the catalogue fitted to all joints together, however far off their values in the cell are. No effect "
      "is weighed against another; diagnose does that. options.effects: ids of effects with one number a joint. "
      "recording, simulator, progress: as of diagnose. Raises "
      "InvalidArgument for an effect that is not in the catalogue or has several parameters.");
}

void bind_residuals(py::module_& m) {
  bind_struct<NoiseOverride>(m, "NoiseOverride", "Noise that differs from what the cell of a recording declares.");
  bind_struct<ResidualColumn>(m, "ResidualColumn", "Residuals of one column of one experiment, row by row.");
  bind_struct<JudgedColumn>(m, "JudgedColumn", "Gap of a column over the experiments that judge it.");
  m.def(
      "residual_columns",
      [](const RecordingSource& recording, const py::object& simulator, const std::vector<kr5::cell::Cell>& cells,
         const std::vector<NoiseOverride>& noise) {
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return residual_columns(*source, s, cells, noise);
        });
      },
      py::arg("recording"), py::arg("simulator") = py::none(), py::arg("cells") = std::vector<kr5::cell::Cell>{},
      py::arg("noise") = std::vector<NoiseOverride>{},
      "Recorded minus simulated over noise of all columns that can be compared, row by row: a column of `residuals` "
      "for the cell of the recording, and one for each of `cells`. `recording`, `simulator`: as of diagnose. The first "
      "of these is taken as correct: samples "
      "that deviate from it, also near edges, count as spikes. Raises InvalidArgument for a cell of another robot, and "
      "when nothing can be "
      "compared.");
  m.def(
      "gap_parts",
      [](const RecordingSource& recording, const std::vector<ResidualColumn>& columns, int which) {
        return gap_parts(*recording_from(recording), columns, which);
      },
      py::arg("recording"), py::arg("columns"), py::arg("which") = 0,
      "Gap by subsystem, target, channel, experiment, pose region and speed: list of GapPart. "
      "`columns`: of residual_columns; `which`: column of `residuals`.");
  m.def("residual_gap", &residual_gap, py::arg("residuals"),
        "RMS of the residuals that are numbers; NaN without any [-].");
  m.def(
      "judged_columns",
      [](const RecordingSource& recording, const std::vector<ResidualColumn>& columns, int which) {
        return judged_columns(*recording_from(recording), columns, which);
      },
      py::arg("recording"), py::arg("columns"), py::arg("which") = 0,
      "Gap of every column over the experiments that judge it (those to check, all where none is): list of "
      "JudgedColumn. `columns`: of residual_columns; `which`: column of `residuals`.");
}

void bind_evidence(py::module_& m) {
  bind_struct<ColumnEvidence>(m, "ColumnEvidence", "What a cause explains of a column.");
  bind_struct<ExperimentEvidence>(m, "ExperimentEvidence", "What a cause explains of an experiment.");
  bind_struct<CauseEvidence>(m, "CauseEvidence", "What residuals say of a cause of a diagnosis.");
  m.def(
      "cause_evidence",
      [](const RecordingSource& recording, const std::vector<ResidualColumn>& columns, int without, int with_all) {
        return cause_evidence(*recording_from(recording), columns, without, with_all);
      },
      py::arg("recording"), py::arg("columns"), py::arg("without"), py::arg("with_all"),
      "What a cause explains of columns and experiments: CauseEvidence. `columns`: of residual_columns; `without`, "
      "`with_all`: columns of `residuals` at the cell with the other causes alone, and with all.");
  m.def(
      "deviations_from_off",
      [](const kr5::cell::Cell& cell, const NameText& effect, const std::vector<ParameterEstimate>& parameters) {
        return deviations_from_off(cell, effect_name(effect), parameters);
      },
      py::arg("cell"), py::arg("effect"), py::arg("parameters"),
      "By how many standard deviations the best known number that tells the size of an effect differs from the value "
      "at which the effect is off [-]; None where none is known. `effect`: EffectName or its text.");
}

void bind_model_doubts(py::module_& m) {
  bind_enum<ModelWarningKind>(m, "ModelWarningKind", "What of a model is warned of: mass | size | zero.");
  bind_struct<ModelWarning, EffectName>(m, "ModelWarning",
                                        "A cause that is larger than the errors of a model usually are.");
  m.def(
      "model_warnings", &model_warnings, py::arg("found"), py::arg("cell"),
      "Causes on joints whose sizes are beyond what is usual by two standard deviations, so that the model may be of\n"
      "another robot, or the log count from another zero: list of ModelWarning. `cell`: without the causes.");
}

/// A diagnosis held against its recording. After the fits of effects.
void bind_explanations(py::module_& m) {
  bind_struct<DiagnosisEvidence>(m, "DiagnosisEvidence", "What a recording says of its diagnosis.")
      .def("cell_without", &DiagnosisEvidence::cell_without, py::arg("cause"),
           "Column of the residuals at the cell with all causes but one (from 0).");
  bind_struct<EffectTrial, EffectName>(m, "EffectTrial",
                                       "Effect fitted to what the other causes of a diagnosis leave.");
  m.def("measured_noise", &measured_noise, py::arg("diagnosis"),
        "Noise that a diagnosis measured, for residuals and fits in its units: list of NoiseOverride.");
  m.def("with_causes", &with_causes, py::arg("cell"), py::arg("causes"),
        "Cell with these causes added, but those that the catalogue does not name. Raises InvalidArgument for a "
        "parameter of the wrong form, and for a target that the cell does not have.");
  m.def(
      "diagnosis_evidence",
      [](const Diagnosis& found, const RecordingSource& recording, const py::object& simulator) {
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return diagnosis_evidence(found, *source, s);
        });
      },
      py::arg("diagnosis"), py::arg("recording"), py::arg("simulator") = py::none(),
      "What a recording says for and against each cause: DiagnosisEvidence. recording, simulator: as of diagnose. "
      "Raises InvalidArgument for a recording of another robot, and when nothing can be compared.");
  m.def(
      "rival_effects",
      [](const Diagnosis& found, const DiagnosisEvidence& evidence, std::size_t cause, const RecordingSource& recording,
         const py::object& simulator) {
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return rival_effects(found, evidence, cause, *source, s);
        });
      },
      py::arg("diagnosis"), py::arg("evidence"), py::arg("cause"), py::arg("recording"),
      py::arg("simulator") = py::none(),
      "Effects that explain most of what a cause (from 0) explains, in its place: at most three EffectFit, best "
      "first.");
  m.def(
      "try_effect",
      [](const Diagnosis& found, const std::string& effect, const std::vector<std::string>& targets,
         const RecordingSource& recording, const py::object& simulator) {
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return try_effect(found, effect, targets, *source, s);
        });
      },
      py::arg("diagnosis"), py::arg("effect"), py::arg("targets"), py::arg("recording"),
      py::arg("simulator") = py::none(),
      "Effect on each of these targets in place of the cause where it explains most, or as the cause that it is: list "
      "of EffectTrial, best first. Raises InvalidArgument for an effect that is not in the catalogue.");
}

void bind_explanation_texts(py::module_& m) {
  bind_struct<Reasons>(m, "Reasons", "Sentences about an effect.");
  m.def("cause_reasons", &cause_reasons, py::arg("diagnosis"), py::arg("cause"), py::arg("evidence") = py::none(),
        "What speaks for and against a cause (from 0): Reasons. evidence: DiagnosisEvidence, or None where the "
        "recording is not known.");
  m.def("rival_texts", &rival_texts, py::arg("rivals"), py::arg("evidence"),
        "What other effects (of rival_effects) do in the place of a cause, a sentence each.");
  m.def("trial_reasons", &trial_reasons, py::arg("trial"), py::arg("diagnosis"), py::arg("evidence"),
        "What speaks for and against an effect that was fitted (of try_effect): Reasons.");
  m.def("floor_text", &floor_text, py::arg("columns"),
        "Of a recording without gap: how near the floor its columns (of judged_columns) are.");
  m.def("model_warning_texts", &model_warning_texts, py::arg("warnings"), py::arg("joint_names"),
        py::arg("described") = "the cell",
        "What speaks against the model, and against the zeros of the log, with causes of unusual size (of "
        "model_warnings), "
        "a sentence each. described: what describes the robot.");
}

void bind_effect_fits(py::module_& m) {
  bind_struct<EffectFitOptions>(m, "EffectFitOptions", "Options of fit_effects and fit_best_effects.");
  bind_struct<EffectFit, EffectName>(m, "EffectFit",
                                     "Effect fitted to the fit experiments and evaluated on the check experiments.");
  m.def(
      "fit_effects",
      [](const RecordingSource& recording, const std::vector<NameText>& effects,
         const std::optional<kr5::cell::Cell>& cell, const py::object& simulator, const EffectFitOptions& options) {
        const auto source = recording_from(recording);
        const std::vector<EffectName> names = effect_names(effects);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return fit_effects(*source, cell ? *cell : source->cell, s, names, options);
        });
      },
      py::arg("recording"), py::arg("effects"), py::arg("cell") = py::none(), py::arg("simulator") = py::none(),
      py::arg("options") = EffectFitOptions{},
      "Fits each of these effects alone to the residuals of the recording under `cell`; best first. Effects that "
      "change "
      "no recorded column are left out.\n\n"
      "Parameters\n----------\n"
      "recording : kr5.cell.Recording, or the folder of one\n"
      "effects : list of EffectName, or of texts effect:target such as coulomb_friction:joint3\n"
      "cell : kr5.cell.Cell, optional\n    By default that of the recording.\n"
      "simulator : as of diagnose, optional\n"
      "options : EffectFitOptions, optional\n\n"
      "Returns\n-------\nlist of EffectFit\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    An effect that is not in the catalogue, or nothing that can be "
      "compared.");
  m.def(
      "fit_best_effects",
      [](const RecordingSource& recording, const std::optional<kr5::cell::Cell>& cell, const py::object& simulator,
         const std::vector<NameText>& except, int most, const EffectFitOptions& options) {
        const auto source = recording_from(recording);
        const std::vector<EffectName> without = effect_names(except);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return fit_best_effects(*source, cell ? *cell : source->cell, s, without, most, options);
        });
      },
      py::arg("recording"), py::arg("cell") = py::none(), py::arg("simulator") = py::none(),
      py::arg("except_") = std::vector<NameText>{}, py::arg("most") = 3, py::arg("options") = EffectFitOptions{},
      "Effects of the catalogue that explain most of the residuals of the recording under `cell`, without those in "
      "`except_`; at most `most`, best first. The other arguments are those of fit_effects.");
}

void bind_plan(py::module_& m) {
  bind_options<PlanOptions>(m, "PlanOptions", "Options of plan.");
  bind_struct<ForecastColumn>(m, "ForecastColumn", "Forecast of one column under each alternative.");
  bind_struct<PlannedExperiment>(m, "PlannedExperiment", "Planned experiment with its forecast.")
      .def_property_readonly(
          "experiment", [](const PlannedExperiment& p) { return p.experiment; },
          "Given columns of the experiment (a copy).");
  bind_struct<Plan>(m, "Plan", "Plan of experiments that distinguish explanations of a recording.")
      .def_property_readonly(
          "cells", [](const Plan& p) { return p.cells; },
          "Cell of the recording with each alternative, which look alike in this recording (copies).");
  bind_struct<ModelComparison>(m, "ModelComparison", "Comparison of several explanations of recordings of one cell.");
  m.def("tied_alternatives", &tied_alternatives, py::arg("diagnosis"),
        "Explanations that a diagnosis could not distinguish, for plan: its causes, and the same with each effect that "
        "could stand in the place of one. Lists of EffectName; empty when nothing is tied.");
  m.def(
      "plan",
      [](const RecordingSource& recording, const std::vector<AlternativeText>& alternatives,
         const py::object& simulator, PlanOptions options, const py::object& progress) {
        options.progress = shared_progress(progress);
        const auto source = recording_from(recording);
        const std::vector<Alternative> wanted = alternatives_from(alternatives);
        return compute_interruptibly(simulator_from(simulator),
                                     [&](const kr5::cell::Simulator& s) { return plan(*source, s, wanted, options); });
      },
      py::arg("recording"), py::arg("alternatives"), py::arg("simulator") = py::none(),
      py::arg("options") = PlanOptions{}, py::arg("progress") = py::none(),
      "Plans the experiment that distinguishes explanations of a recording, from their signatures.\n\n"
      "Parameters\n----------\n"
      "recording : kr5.cell.Recording, or the folder of one\n"
      "alternatives : two or more effects, or lists of effects that act together\n"
      "    An effect is an EffectName or a text effect:target, as of fit_effects; those of "
      "tied_alternatives(diagnosis).\n"
      "simulator, progress : as of diagnose, optional\n"
      "options : PlanOptions, optional\n\n"
      "Returns\n-------\nPlan\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    An effect that the cell cannot have.");
  m.def(
      "compare_models",
      [](const std::vector<RecordingSource>& recordings, const std::vector<AlternativeText>& alternatives,
         const py::object& simulator, const PlanOptions& options) {
        std::vector<kr5::cell::Recording> all;
        for (const RecordingSource& recording : recordings) all.push_back(*recording_from(recording));
        const std::vector<Alternative> wanted = alternatives_from(alternatives);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return compare_models(all, s, wanted, options);
        });
      },
      py::arg("recordings"), py::arg("alternatives"), py::arg("simulator") = py::none(),
      py::arg("options") = PlanOptions{},
      "Fits each alternative to all recordings (a list) together and returns its probability; the cells may differ in "
      "the tool. The other arguments are those of plan.");
  m.def("with_load", &with_load, py::arg("cell"), py::arg("mass"),
        "Cell with a known weight on the tool: a point mass [kg] at the tool's centre of mass.");
}

}  // namespace

void bind_gap(py::module_& m) {
  m.doc() = "Gap between simulation and recording: measurement, diagnosis, next experiment.";
  bind_hypotheses(m);
  bind_typical_effect(m);
  bind_diagnosis(m);
  bind_joint_fit(m);
  bind_residuals(m);
  bind_evidence(m);
  bind_model_doubts(m);
  bind_effect_fits(m);
  bind_explanations(m);
  bind_explanation_texts(m);
  bind_plan(m);
  bind_struct<ColumnGap>(m, "ColumnGap", "Gap of one column of one experiment.");
  bind_struct<GapPart>(m, "GapPart", "Gap of all columns that share a property.");
  bind_struct<Measure>(m, "Measure", "Gap of every column of a recording.");
  m.def("noise_limit", &noise_limit, py::arg("rows"), py::arg("columns") = 1,
        "Gap of so many rows that noise alone exceeds once in a thousand columns, or in any of so many columns once in "
        "a thousand recordings; infinite without rows [-].");
  m.def(
      "measure",
      [](const RecordingSource& recording, const py::object& simulator, const std::optional<kr5::cell::Cell>& cell) {
        const auto source = recording_from(recording);
        return compute_interruptibly(simulator_from(simulator), [&](const kr5::cell::Simulator& s) {
          return measure(*source, cell ? *cell : source->cell, s);
        });
      },
      py::arg("recording"), py::arg("simulator") = py::none(), py::arg("cell") = py::none(),
      "RMS of (recorded - simulated) over the noise, of every recorded and predicted column; 1 is the floor.\n\n"
      "Parameters\n----------\n"
      "recording : kr5.cell.Recording, or the folder of one\n"
      "simulator : as of diagnose, optional\n"
      "cell : kr5.cell.Cell, optional\n    By default that of the recording.\n\n"
      "Returns\n-------\nMeasure\n    Experiments that the simulator cannot predict are left out and listed in "
      "`refused`.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    No experiment can be compared.");
}
