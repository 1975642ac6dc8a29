// a block with a groove, an arc of 60 degrees to either side
r = 1.05;  a = Pi / 3;  h = 0.1;  y = -r * Cos(a);
Point(1) = {0, 0, 0};  // the centre of the arc
Point(2) = {-r * Sin(a), y, 0, h};
Point(3) = {r * Sin(a), y, 0, h};
Point(4) = {2, y, 0, 4 * h};
Point(5) = {2, -2, 0, 4 * h};
Point(6) = {-2, -2, 0, 4 * h};
Point(7) = {-2, y, 0, 4 * h};
Circle(1) = {2, 1, 3};
Line(2) = {3, 4};  Line(3) = {4, 5};  Line(4) = {5, 6};
Line(5) = {6, 7};  Line(6) = {7, 2};
Curve Loop(1) = {1:6};
Plane Surface(1) = {1};
Physical Curve("groove") = {1};
Physical Curve("base") = {4};
Physical Surface("block") = {1};
