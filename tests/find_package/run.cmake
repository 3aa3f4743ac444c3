# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -D BUILD= -D CONFIG= -D SAMPLES= -D MAKE_PANELS= -D COMPILER= -D FLAGS= -D GENERATOR= -D MAKE_PROGRAM= -P run.cmake
# Installs the build tree to a folder of its own, builds this folder's project against it and runs what comes out.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\n${output}\nended with ${code}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(work ${BUILD}/find_package)
file(REMOVE_RECURSE ${work})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix --config ${CONFIG})
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${work}/build -G ${GENERATOR} -DCMAKE_MAKE_PROGRAM=${MAKE_PROGRAM}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_BUILD_TYPE=Debug
    -DCMAKE_PREFIX_PATH=${work}/prefix -DEXAMPLE=${SAMPLES}/library_example)
run(${CMAKE_COMMAND} --build ${work}/build)
run(${MAKE_PANELS} ${work})
file(COPY ${SAMPLES}/kidnapped_a/scene.toml DESTINATION ${work}/kidnapped_a)

# A quarter of an annulus of radii 0.2228 m and 0.7728 m, 0.4301 m2, whose two sides of 0.55 m bulge by less than 12 mm.
# Hung from its waist it reaches 0.55 m down along the threads, on the bias at most sqrt(2) times that and what the limit
# allows.
set(draped ${work}/draped.igs)
run(${work}/build/example/drape_panel ${work}/skirt_panel/skirt_panel.igs ${draped} curve:0,2)
message("${output}")
if(NOT output MATCHES "^front: (0\\.[0-9]+) m2, [1-9][0-9]+ constraint points" OR CMAKE_MATCH_1 LESS 0.4301
   OR CMAKE_MATCH_1 GREATER 0.4433)
  message(FATAL_ERROR "the example says: ${output}")
endif()
if(NOT output MATCHES "hangs down to z = -(0\\.[0-9]+) m" OR CMAKE_MATCH_1 LESS 0.5 OR CMAKE_MATCH_1 GREATER 0.8)
  message(FATAL_ERROR "the example says: ${output}")
endif()
run(${work}/prefix/bin/toile inspect ${draped})
if(NOT output MATCHES "front draped")
  message(FATAL_ERROR "the installed program doesn't know what the example wrote: ${output}")
endif()
run(${work}/build/every_room ${work}/kidnapped_a/scene.toml)
message("${output}")
