# SPDX-License-Identifier: GPL-3.0-or-later
# Libraries that bring no CMake package of their own. Our build reads this file, and so does find_package(Toile).
#   toile_find_library(<name>): the imported target toile::<name>.
function(toile_find_library name)
  string(TOUPPER ${name} upper)
  find_library(TOILE_${upper}_LIBRARY ${name})
  mark_as_advanced(TOILE_${upper}_LIBRARY)
  if(NOT TOILE_${upper}_LIBRARY)
    message(FATAL_ERROR "Toile needs lib${name} and its development files")
  endif()
  if(NOT TARGET toile::${name})
    add_library(toile::${name} UNKNOWN IMPORTED GLOBAL)
    set_target_properties(toile::${name} PROPERTIES IMPORTED_LOCATION ${TOILE_${upper}_LIBRARY})
  endif()
endfunction()
