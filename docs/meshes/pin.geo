// half a pin that touches the bottom of the groove
r = 1;  a = 5 * Pi / 18;  y = -0.05;  h = 0.08;
Point(1) = {0, y, 0, 3 * h};  // the centre
Point(2) = {-r, y, 0, 3 * h};
Point(3) = {-r * Sin(a), y - r * Cos(a), 0, h};
Point(4) = {r * Sin(a), y - r * Cos(a), 0, h};
Point(5) = {r, y, 0, 3 * h};
Circle(1) = {2, 1, 3};
Circle(2) = {3, 1, 4};  // 50 degrees to either side
Circle(3) = {4, 1, 5};
Line(4) = {5, 1};  Line(5) = {1, 2};
Curve Loop(1) = {1:5};
Plane Surface(1) = {1};
Physical Curve("tip") = {2};
Physical Curve("top") = {4, 5};
Physical Surface("pin") = {1};
