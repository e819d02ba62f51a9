#include <iostream>

#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/arm_log/read_log.hpp>
#include <kr5/cell/import_urdf.hpp>

int main(int, char** words) {  // LOG.csv ROBOT.urdf
  const kr5::cell::Cell model = kr5::cell::import_urdf(words[2]).cell;
  const kr5::arm_log::ArmLog log = kr5::arm_log::read_log(words[1], model);
  const kr5::gap::Diagnosis found = kr5::arm_log::diagnose_log(log, model).diagnosis;
  for (const kr5::gap::Cause& cause : found.causes) std::cout << cause.effect << " of " << cause.target << '\n';
  return found.verdict == kr5::gap::Verdict::Explained && found.causes.size() == 1 ? 0 : 1;
}
