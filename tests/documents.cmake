# Tests of the documents: the tables of figures are those of docs/results, no file has a retired
# word, links lead somewhere.
find_package(Python3 3.10 REQUIRED COMPONENTS Interpreter)
add_test(NAME results COMMAND ${Python3_EXECUTABLE} -B ${PROJECT_SOURCE_DIR}/scripts/results --check)
add_test(NAME tables COMMAND ${Python3_EXECUTABLE} -B ${PROJECT_SOURCE_DIR}/scripts/tables --check)
add_test(NAME tables_script COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_SOURCE_DIR}/tables_test.py)
add_test(NAME counts COMMAND ${Python3_EXECUTABLE} -B ${PROJECT_SOURCE_DIR}/scripts/counts --check)
set_tests_properties(counts PROPERTIES SKIP_RETURN_CODE 77) # without the history
add_test(NAME versions COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_SOURCE_DIR}/versions_test.py)
add_test(NAME words COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_SOURCE_DIR}/words_test.py)
add_test(NAME links COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_SOURCE_DIR}/links_test.py)

# Commands and flags in the documents are those of the programs.
if(TARGET meshsmooth AND TARGET meshsmooth-server)
  add_test(NAME commands COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_SOURCE_DIR}/commands_test.py
    $<TARGET_FILE:meshsmooth> $<TARGET_FILE:meshsmooth-server>)
endif()

# The reference of the public headers; warnings are errors.
find_program(MESHSMOOTH_DOXYGEN doxygen)
if(MESHSMOOTH_DOXYGEN)
  add_test(NAME reference
    COMMAND ${PROJECT_SOURCE_DIR}/scripts/reference ${PROJECT_BINARY_DIR}/reference_test)
else()
  meshsmooth_add_skipped_test(reference "doxygen is not installed")
endif()
