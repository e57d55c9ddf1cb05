# Compiles files of one folder together, where TIND_UNITY is on: their headers, which are most of the
# work, are read once for all of them. For builds from nothing (CI's); where one goes
# on working, a change of one file would compile all its neighbours.
#
# scripts/unity_groups says which go together; scripts/unity_alone.txt names files that never do.

# unity(LIST): files, with their full paths, become files that include them.
function(unity LIST)
  if(NOT TIND_UNITY)
    return()
  endif()
  file(STRINGS ${CMAKE_SOURCE_DIR}/scripts/unity_alone.txt ALONE REGEX "^[^#]")
  set(UNITS "")
  set(NAMES "")
  foreach(FILE ${${LIST}})
    file(RELATIVE_PATH NAME ${CMAKE_SOURCE_DIR} ${FILE})
    if(NAME IN_LIST ALONE)
      list(APPEND UNITS ${FILE})
    else()
      list(APPEND NAMES ${NAME})
    endif()
  endforeach()
  execute_process(COMMAND ${CMAKE_SOURCE_DIR}/scripts/unity_groups ${CMAKE_SOURCE_DIR} ${NAMES}
    OUTPUT_VARIABLE GROUPS OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" "|" GROUPS "${GROUPS}")
  string(REPLACE "\n" ";" GROUPS "${GROUPS}")
  foreach(GROUP ${GROUPS})
    string(REPLACE "|" ";" GROUP ${GROUP})
    list(GET GROUP 0 UNIT)
    list(TRANSFORM GROUP REPLACE "(.+)" "#include \"\\1\"\n")
    string(CONCAT TEXT ${GROUP})
    set(UNIT ${CMAKE_BINARY_DIR}/unity/${UNIT})  # by its first file's name
    file(CONFIGURE OUTPUT ${UNIT} CONTENT "${TEXT}" @ONLY)
    list(APPEND UNITS ${UNIT})
  endforeach()
  set(${LIST} ${UNITS} PARENT_SCOPE)
endfunction()
