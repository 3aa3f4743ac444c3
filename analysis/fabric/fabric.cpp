#include "analysis/fabric/fabric.h"
