#include "trimming/topology.h"
