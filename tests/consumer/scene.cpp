#include <iostream>

#include <kr5/sim/scene.hpp>

int main(int, char** words) {
  const kr5::sim::SceneResult result = kr5::sim::run_scene(words[1]);
  std::cout << result.steps << " steps, " << (result.passed ? "as expected" : "not as expected") << '\n';
  return result.passed ? 0 : 1;
}
