# kr5_module(<name> [DEPENDS kr5 modules] [PACKAGES private third-party] [LINKS targets] [FOLDER folder])
# Describes one module, whose sources stand in src/<name>/, or in <FOLDER>/src/ for one with a top-level folder of its
# own; nothing is searched for or built until kr5_build_modules() asks for it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

macro(kr5_module name)
  cmake_parse_arguments(_m "" "FOLDER" "DEPENDS;PACKAGES;LINKS" ${ARGN})
  foreach(_d IN LISTS _m_DEPENDS)
    if(NOT _d IN_LIST KR5_ALL_MODULES)
      message(FATAL_ERROR "kr5: module '${name}' uses '${_d}', which is not declared above it")
    endif()
  endforeach()
  list(APPEND KR5_ALL_MODULES ${name})
  foreach(_f DEPENDS PACKAGES LINKS)
    set(KR5_${name}_${_f} ${_m_${_f}})
  endforeach()
  set(KR5_${name}_INCLUDE ${PROJECT_SOURCE_DIR}/libkr5/include)
  set(KR5_${name}_PRIVATE ${PROJECT_SOURCE_DIR}/libkr5/src)
  set(KR5_${name}_SOURCES ${PROJECT_SOURCE_DIR}/libkr5/src/${name})
  if(_m_FOLDER)
    set(KR5_${name}_INCLUDE ${PROJECT_SOURCE_DIR}/${_m_FOLDER}/include)
    set(KR5_${name}_PRIVATE ${PROJECT_SOURCE_DIR}/${_m_FOLDER}/src)
    set(KR5_${name}_SOURCES ${PROJECT_SOURCE_DIR}/${_m_FOLDER}/src)
  endif()
endmacro()

# Every target of a module gets the same language level, warnings and position-independent code.
function(kr5_compile_settings target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wno-sign-conversion
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>  # GCC 12 warns falsely about std::string operator+
    $<$<CONFIG:Release>:-O2>  # instead of -O3, which takes longer to compile
    $<$<BOOL:${KR5_WARNINGS_AS_ERRORS}>:-Werror>)
endfunction()

function(_kr5_build name)
  if(TARGET kr5_${name})
    return()
  endif()
  if(NOT name IN_LIST KR5_ALL_MODULES)
    message(FATAL_ERROR "kr5: unknown module '${name}'; there are ${KR5_ALL_MODULES}")
  endif()
  foreach(dep IN LISTS KR5_${name}_DEPENDS)
    _kr5_build(${dep})
  endforeach()
  set(CMAKE_DISABLE_FIND_PACKAGE_VTK TRUE)  # PCL looks for it, nothing here uses it, and it asks for the language C
  foreach(package IN LISTS KR5_${name}_PACKAGES)
    string(REPLACE " " ";" package "${package}")  # "PCL COMPONENTS common" is one entry
    get_directory_property(definitions COMPILE_DEFINITIONS)
    find_package(${package} REQUIRED)  # in a function: what a package does to the flags ends here
    set_directory_properties(PROPERTIES COMPILE_DEFINITIONS "${definitions}")  # DART's leaks BOOST_TEST_DYN_LINK
  endforeach()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${KR5_${name}_SOURCES}/*.cpp)
  # ViSP 3.5's headers are not C++20 (vpArray2D<Type>() as a constructor): their users are files of their own.
  set(visp_sources ${sources})
  list(FILTER visp_sources INCLUDE REGEX "/visp_[a-z_]*\\.cpp$")
  if(visp_sources)
    set_source_files_properties(${visp_sources} PROPERTIES
      COMPILE_OPTIONS -std=c++17 SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
  add_library(kr5_${name} ${sources})
  add_library(kr5::${name} ALIAS kr5_${name})
  kr5_compile_settings(kr5_${name})
  set_target_properties(kr5_${name} PROPERTIES EXPORT_NAME ${name})
  if(KR5_UNITY)
    set_target_properties(kr5_${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 64)
  endif()
  target_include_directories(kr5_${name} PUBLIC
    $<BUILD_INTERFACE:${KR5_${name}_INCLUDE}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${KR5_${name}_PRIVATE})
  list(TRANSFORM KR5_${name}_DEPENDS PREPEND kr5:: OUTPUT_VARIABLE deps)
  target_link_libraries(kr5_${name} PUBLIC ${deps} PRIVATE ${KR5_${name}_LINKS})
  if(name STREQUAL "core")
    target_link_libraries(kr5_core PUBLIC Eigen3::Eigen)
  endif()
  set_property(GLOBAL APPEND PROPERTY KR5_BUILT_MODULES ${name})
  message(STATUS "kr5 module ${name}  <- ${KR5_${name}_DEPENDS} | ${KR5_${name}_PACKAGES}")
endfunction()

# Installs headers, library and one export file a module, so that find_package(kr5 COMPONENTS x)
# searches only for what x needs.
function(_kr5_install)
  set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/kr5)
  get_property(built GLOBAL PROPERTY KR5_BUILT_MODULES)
  set(KR5_COMPONENT_TABLE "")
  foreach(name IN LISTS built)
    install(TARGETS kr5_${name} EXPORT kr5-${name})
    install(EXPORT kr5-${name} NAMESPACE kr5:: DESTINATION ${package_dir})
    install(DIRECTORY ${KR5_${name}_INCLUDE}/kr5/${name} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kr5)
    string(APPEND KR5_COMPONENT_TABLE
      "set(_kr5_${name}_depends ${KR5_${name}_DEPENDS})\nset(_kr5_${name}_packages \"${KR5_${name}_PACKAGES}\")\n")
  endforeach()
  set(KR5_INSTALLED_MODULES ${built})
  configure_package_config_file(${PROJECT_SOURCE_DIR}/libkr5/cmake/kr5Config.cmake.in
    ${PROJECT_BINARY_DIR}/kr5Config.cmake INSTALL_DESTINATION ${package_dir})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/kr5ConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/kr5Config.cmake ${PROJECT_BINARY_DIR}/kr5ConfigVersion.cmake
    DESTINATION ${package_dir})
  install(FILES ${PROJECT_SOURCE_DIR}/package.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/kr5)  # where ROS looks for it
endfunction()

function(kr5_build_modules)
  set(wanted ${ARGN})
  if(wanted STREQUAL "all")
    set(wanted ${KR5_ALL_MODULES})
  endif()
  foreach(name IN LISTS wanted)
    _kr5_build(${name})
  endforeach()
  if(KR5_INSTALL_LIBRARY)
    _kr5_install()
  endif()
endfunction()
