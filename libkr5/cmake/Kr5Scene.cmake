# kr5_add_scene_test(<name> <scene.yaml>)
# A ctest that runs a scene (format kr5-scene/1) in DART and passes when all the scene expects comes true. The file is
# looked for beside the CMakeLists.txt that calls this.
function(kr5_add_scene_test name scene)
  cmake_path(ABSOLUTE_PATH scene BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
  if(NOT EXISTS ${scene})
    message(FATAL_ERROR "kr5_add_scene_test(${name}): there is no file ${scene}")
  endif()
  add_test(NAME ${name} COMMAND kr5::scene_runner ${scene})
  set_tests_properties(${name} PROPERTIES LABELS scene TIMEOUT 600)
endfunction()
