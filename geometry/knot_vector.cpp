#include "geometry/knot_vector.h"
