// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/motion_proposals.hpp"

#include <algorithm>
#include <cmath>

#include "gap/planning/workspace.hpp"

namespace kr5::gap {
namespace {

constexpr double hang = 300.0;          // to hang a weight on the tool [s]
constexpr double pose_interval = 30.0;  // to measure a pose from outside, where none was recorded [s]

class Motions {
 public:
  explicit Motions(const Family& family)
      : family_(family),
        workspace_(family),
        random_(family.seed),
        start_(end_time_of(family.recording, cell::Kind::Motion) + 30) {}

  std::vector<Proposal> all() {
    const double duration = family_.brief ? 8.0 : 20.0;
    for (const double part : {0.9, 0.25, 0.03}) together(workspace_.home, "", 0.8, part, duration, 0.0, 0.0);
    if (!family_.brief) {
      together(workspace_.home, "", 0.25, 0.5, duration, 0.0, 0.0);
      together(workspace_.random_extreme(random_, true), ", the arm stretched", 0.3, 0.4, duration, 0.0, 0.0);
      together(workspace_.random_extreme(random_, false), ", the arm drawn in", 0.3, 0.4, duration, 0.0, 0.0);
      for (const double part : {0.25, 1.0})
        if (family_.wait > 0) together(workspace_.home, "", 0.8, 0.4, duration, part * family_.wait, 0.0);
      if (start_ > 60) cold(duration);
    }
    if (family_.load > 0)
      for (const double part : {0.6, 0.1}) together(workspace_.home, "", 0.8, part, duration, 0.0, family_.load);
    for (int joint = 0; joint < workspace_.cell.robot.joints(); ++joint) one(joint);
    return std::move(out_);
  }

 private:
  bool of_interest(int joint) const {
    return std::find(family_.joints.begin(), family_.joints.end(), joint) != family_.joints.end();
  }

  void one(int joint) {
    const bool closer = of_interest(joint);
    if (family_.brief && !closer) return;
    const double most = workspace_.speed(joint);
    swing(joint, workspace_.home, "", 1.2, most, 0.0);
    swing(joint, workspace_.home, "", 0.3, 0.05 * most, 0.0);
    if (!closer) return;
    swing(joint, workspace_.home, "", 0.05, 0.004 * most, 0.0);
    if (family_.brief) return;
    swing(joint, workspace_.home, "", 0.05, 0.2 * most, 0.0);
    swing(joint, workspace_.home, "", 0.5, 0.3 * most, 0.0);
    swing(joint, workspace_.random_extreme(random_, true), ", the arm stretched", 0.5, 0.2 * most, 0.0);
    swing(joint, workspace_.random_extreme(random_, false), ", the arm drawn in", 0.5, 0.2 * most, 0.0);
    if (family_.load > 0) swing(joint, workspace_.home, "", 0.5, 0.2 * most, family_.load);
  }

  /// One joint to and fro, fading in and out, for 8 s or one turn at least.
  void swing(int joint, const Eigen::VectorXd& middle, const std::string& where, double reach, double speed,
             double load) {
    reach = std::min({reach, workspace_.high(joint) - middle(joint), middle(joint) - workspace_.low(joint)});
    if (reach < 0.02) return;
    const double omega = speed / reach, period = 2 * M_PI / omega;
    const double duration = period * std::max(2.0, std::round((family_.brief ? 6.0 : 10.0) / period));
    if (duration > 180.0) return;
    const auto rows = static_cast<Eigen::Index>(duration / workspace_.cycle);
    Eigen::VectorXd wave(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = workspace_.cycle * static_cast<double>(i),
                   edge = std::min({1.0, 2 * t / period, 2 * (duration - t) / period});
      wave(i) = std::pow(std::sin(M_PI / 2 * edge), 2) * std::sin(omega * t);
    }
    Eigen::MatrixXd path = middle.transpose().replicate(rows, 1);
    path.col(joint) += reach * wave;
    add(path,
        "swing joint " + std::to_string(joint + 1) + " by " + two_digits(reach) + unit(joint) + " at " +
            two_digits(speed) + unit(joint) + "/s" + where,
        0.0, load, start_);
  }

  std::string unit(int joint) const {
    return workspace_.cell.robot.dh[static_cast<std::size_t>(joint)].type == kinematics::JointType::Prismatic ? " m"
                                                                                                              : " rad";
  }

  /// All joints, each a sum of sines, from a posture and back.
  Eigen::MatrixXd waves(const Eigen::VectorXd& middle, double reach, double part, double duration) {
    constexpr int harmonics = 5;
    const auto rows = static_cast<Eigen::Index>(duration / workspace_.cycle);
    Eigen::MatrixXd path = middle.transpose().replicate(rows, 1);
    for (Eigen::Index j = 0; j < path.cols(); ++j) {
      Eigen::VectorXd wave = Eigen::VectorXd::Zero(rows);
      for (int k = 1; k <= harmonics; ++k) {
        const double a = random_.normal(), b = random_.normal(), rate = 2 * M_PI * 0.1 * k;
        for (Eigen::Index i = 0; i < rows; ++i) {
          const double t = workspace_.cycle * static_cast<double>(i);
          wave(i) += (a * std::sin(rate * t) + b * std::cos(rate * t)) * std::pow(std::sin(M_PI * t / duration), 2);
        }
      }
      const double fastest = (wave.tail(rows - 1) - wave.head(rows - 1)).cwiseAbs().maxCoeff() / workspace_.cycle;
      const double space = std::min({reach, workspace_.high(j) - middle(j), middle(j) - workspace_.low(j)});
      path.col(j) +=
          wave * std::min(std::max(space, 0.0) / wave.cwiseAbs().maxCoeff(), part * workspace_.speed(j) / fastest);
    }
    return path;
  }

  void together(const Eigen::VectorXd& middle, const std::string& where, double reach, double part, double duration,
                double wait, double load) {
    std::string what = "move all joints at once within " + two_digits(reach) + " rad, up to " +
                       two_digits(100 * part * family_.speed) + " % of the speed limits" + where;
    if (wait > 0) what += ", after the cell has been kept moving for " + two_digits(wait / 60) + " min more";
    // A path that would go too low is made smaller until it does not.
    Eigen::MatrixXd path = waves(middle, reach, part, duration);
    for (int i = 0; i < 4 && !workspace_.contains_path(path); ++i)
      path = 0.6 * path + 0.4 * middle.transpose().replicate(path.rows(), 1);
    add(path, what, wait, load, start_ + wait);
  }

  void cold(double duration) {
    add(waves(workspace_.home, 0.6, 0.4, duration), "move all joints at once right after a cold start", 0.0, 0.0, 0.0);
  }

  void add(const Eigen::MatrixXd& path, std::string what, double wait, double load, double start) {
    if (!workspace_.contains_path(path)) return;
    if (load > 0) what += ", with " + two_digits(load) + " kg more on the tool";
    // A cell without servos cannot simulate how an arm follows commands; its motors then follow the path itself.
    const auto& servo = workspace_.cell.servo;
    const cell::JointReference reference = servo && (!servo->joint.empty() || workspace_.cell.has_torque_servos())
                                               ? cell::JointReference::Commanded
                                               : cell::JointReference::Measured;
    Proposal p{
        {"next", cell::Kind::Motion, "next.csv", cell::Split::Fit, {}, reference, {}}, std::move(what), load, 0.0};
    p.seconds = set_up + workspace_.cycle * static_cast<double>(path.rows()) + wait + (load > 0 ? hang : 0.0);
    p.experiment.data.columns = {"t"};
    for (Eigen::Index j = 0; j < path.cols(); ++j) p.experiment.data.columns.push_back("qc" + std::to_string(j + 1));
    p.experiment.data.values.resize(path.rows(), path.cols() + 1);
    p.experiment.data.values.col(0) =
        Eigen::VectorXd::LinSpaced(path.rows(), start, start + workspace_.cycle * static_cast<double>(path.rows() - 1));
    p.experiment.data.values.rightCols(path.cols()) = path;
    out_.push_back(std::move(p));
  }

  const Family& family_;
  Workspace workspace_;
  Random random_;
  double start_ = 0.0;
  std::vector<Proposal> out_;
};

class Poses {
 public:
  explicit Poses(const Family& family) : family_(family), workspace_(family), random_(family.seed) {
    const cell::Experiment* before = recorded_experiment(family.recording, cell::Kind::Poses);
    if (!before) return;
    const int t = before->data.find("t");
    if (t < 0) return;
    const Eigen::Index rows = before->data.values.rows();
    interval_ =
        std::max((before->data.values(rows - 1, t) - before->data.values(0, t)) / static_cast<double>(rows - 1), 1.0);
  }

  std::vector<Proposal> all() {
    const double after = end_time_of(family_.recording, cell::Kind::Poses) + interval_;
    const Eigen::VectorXd middle = (workspace_.low + workspace_.high) / 2;
    const double whole = ((workspace_.high - workspace_.low) / 2).maxCoeff();
    spread(workspace_.home, 0.4, "within 0.4 rad of where the motion began", after, 0.0);
    spread(middle, whole, "over the whole range of every joint", after, 0.0);
    if (!family_.brief) {
      spread(workspace_.random_extreme(random_, true), 0.3, "with the arm stretched", after, 0.0);
      spread(workspace_.random_extreme(random_, false), 0.3, "with the arm drawn in", after, 0.0);
      if (family_.wait > 0)
        spread(workspace_.home, 1.0,
               "after the cell has been kept moving for " + two_digits(family_.wait / 60) + " min more",
               after + family_.wait, 0.0);
      if (after > 600) spread(workspace_.home, 1.0, "right after a cold start", 0.0, 0.0);
    }
    if (family_.load > 0) spread(middle, whole, "over the whole range of every joint", after, family_.load);
    for (int j = 0; j < workspace_.cell.robot.joints(); ++j)
      if (!family_.brief || std::find(family_.joints.begin(), family_.joints.end(), j) != family_.joints.end())
        sweep(j, after);
    return std::move(out_);
  }

 private:
  void spread(const Eigen::VectorXd& middle, double reach, const std::string& where, double start, double load) {
    Eigen::MatrixXd q(count, middle.size());
    for (int i = 0; i < count; ++i) q.row(i) = workspace_.random_near(random_, middle, reach);
    add(q, "measure " + std::to_string(count) + " poses " + where, start, load);
  }

  void sweep(int joint, double start) {
    Eigen::MatrixXd q = workspace_.home.transpose().replicate(count, 1);
    q.col(joint) = Eigen::VectorXd::LinSpaced(count, workspace_.low(joint), workspace_.high(joint));
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < count; ++i)
      if (workspace_.contains_path(q.row(i))) kept.push_back(i);
    if (kept.size() > 5)
      add(q(kept, Eigen::all),
          "measure " + std::to_string(kept.size()) + " poses over the range of joint " + std::to_string(joint + 1) +
              ", the others at rest",
          start, 0.0);
  }

  void add(const Eigen::MatrixXd& q, std::string what, double start, double load) {
    if (load > 0) what += ", with " + two_digits(load) + " kg more on the tool";
    Proposal p{{"next", cell::Kind::Poses, "next.csv", cell::Split::Fit, {}, {}, {}}, std::move(what), load, 0.0};
    const double before = end_time_of(family_.recording, cell::Kind::Poses);
    p.seconds = set_up + interval_ * static_cast<double>(q.rows()) + std::max(start - before - interval_, 0.0) +
                (load > 0 ? hang : 0.0);
    io::Table& table = p.experiment.data;
    table.columns = {"pose", "t"};
    for (Eigen::Index j = 0; j < q.cols(); ++j) table.columns.push_back("q" + std::to_string(j + 1));
    table.values.resize(q.rows(), q.cols() + 2);
    for (Eigen::Index i = 0; i < q.rows(); ++i)
      table.values.row(i) << static_cast<double>(i), start + interval_ * static_cast<double>(i), q.row(i);
    out_.push_back(std::move(p));
  }

  static constexpr int count = 30;
  const Family& family_;
  Workspace workspace_;
  Random random_;
  double interval_ = pose_interval;
  std::vector<Proposal> out_;
};

}  // namespace

std::vector<Proposal> motion_proposals(const Family& family) { return Motions(family).all(); }
std::vector<Proposal> pose_proposals(const Family& family) { return Poses(family).all(); }

}  // namespace kr5::gap
