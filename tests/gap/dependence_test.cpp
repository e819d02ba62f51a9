#include <catch2/catch.hpp>

#include <kr5/gap/dependence.hpp>

namespace dependence_test {

using namespace kr5::gap;

TEST_CASE("the notation of a variable reads back") {
  using enum VariableKind;
  for (const Variable& v :
       {Variable{JointPosition, 3}, Variable{JointVelocity, 12}, Variable{JointSpeed, 2},
        Variable{JointAcceleration, 7}, Variable{PathVelocity}, Variable{Column, 0, "t"}, Variable{Prediction, 0, "i3"},
        Variable{Experiment}, Variable{ExperimentKind}, Variable{WhichColumn}, Variable{}}) {
    CAPTURE(symbol(v));
    CHECK(find_variable(symbol(v)) == v);
  }
  CHECK(symbol({JointSpeed, 2}) == "|qd2|");
  CHECK(symbol({JointPosition, 3, "", "motion"}) == "motion q3");
}

TEST_CASE("a text that is no notation of a joint is a column") {
  for (const std::string text : {"q", "qd", "|qd2", "q0", "q-1", "qx", "q1x", "tau3", "|q1|"}) {
    CAPTURE(text);
    CHECK(find_variable(text) == Variable{VariableKind::Column, 0, text});
  }
}

}  // namespace dependence_test
